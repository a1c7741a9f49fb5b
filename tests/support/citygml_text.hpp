#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

namespace canyon::test {

/// A CityGML 2.0 document of these members; `srs` empty: without an envelope.
inline std::string citygml(const std::string& members, const std::string& srs = "EPSG:25832",
                           const std::string& lower = "691000 5334000 500",
                           const std::string& upper = "691010 5334008 509") {
  std::string envelope;
  if (!srs.empty()) {
    envelope = fmt::format(
        "<gml:boundedBy><gml:Envelope srsName=\"{}\" srsDimension=\"3\"><gml:lowerCorner>{}</gml:lowerCorner>"
        "<gml:upperCorner>{}</gml:upperCorner></gml:Envelope></gml:boundedBy>\n",
        srs, lower, upper);
  }
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<core:CityModel "
         "xmlns:core=\"http://www.opengis.net/citygml/2.0\" "
         "xmlns:bldg=\"http://www.opengis.net/citygml/building/2.0\" "
         "xmlns:gml=\"http://www.opengis.net/gml\" xmlns:xlink=\"http://www.w3.org/1999/xlink\">\n" +
         envelope + members + "</core:CityModel>\n";
}

inline std::string citygml_member(const std::string& object) {
  return "<core:cityObjectMember>" + object + "</core:cityObjectMember>\n";
}

/// A gml:Polygon of rings as posLists, the outer one first.
inline std::string gml_polygon(const std::vector<std::string>& rings, const std::string& id = "") {
  std::string text = id.empty() ? "<gml:Polygon>" : fmt::format("<gml:Polygon gml:id=\"{}\">", id);
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const char* side = i == 0 ? "exterior" : "interior";
    text += fmt::format("<gml:{0}><gml:LinearRing><gml:posList>{1}</gml:posList></gml:LinearRing></gml:{0}>",
                        side, rings[i]);
  }
  return text + "</gml:Polygon>";
}

inline std::string gml_member(const std::string& surface) {
  return "<gml:surfaceMember>" + surface + "</gml:surfaceMember>";
}

/// The posLists of a house of 10 m x 8 m with a gable roof along x: eaves at 6 m, ridge at 9 m (600 m^3),
/// with its corner at east, north, up: ground, four walls, two halves of the roof, front sides outwards.
inline std::vector<std::string> gml_house(double e = 691000, double n = 5334000, double u = 500) {
  const double corners[10][3] = {{0, 0, 0},  {10, 0, 0}, {10, 8, 0}, {0, 8, 0}, {0, 0, 6},
                                 {10, 0, 6}, {10, 8, 6}, {0, 8, 6},  {0, 4, 9}, {10, 4, 9}};
  const std::vector<std::vector<int>> faces{{0, 3, 2, 1},    {0, 1, 5, 4}, {1, 2, 6, 9, 5}, {2, 3, 7, 6},
                                            {3, 0, 4, 8, 7}, {4, 5, 9, 8}, {6, 7, 8, 9}};
  std::vector<std::string> rings;
  for (const std::vector<int>& face : faces) {
    std::string ring;
    for (std::size_t i = 0; i <= face.size(); ++i) {
      const double* c = corners[face[i % face.size()]];
      ring += fmt::format("{:.3f} {:.3f} {:.3f} ", e + c[0], n + c[1], u + c[2]);
    }
    rings.push_back(ring);
  }
  return rings;
}

/// A Building with thematic surfaces and a solid that refers to them, of LoD 2; `more` is its first content.
inline std::string gml_building(const std::string& id, const std::vector<std::string>& rings = gml_house(),
                                const std::string& more = "") {
  static const char* const kNames[] = {"GroundSurface", "WallSurface", "WallSurface", "WallSurface",
                                       "WallSurface",   "RoofSurface", "RoofSurface"};
  std::string solid, surfaces;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    solid += fmt::format("<gml:surfaceMember xlink:href=\"#{}_{}\"/>", id, i);
    surfaces += fmt::format(
        "<bldg:boundedBy><bldg:{0}><bldg:lod2MultiSurface><gml:MultiSurface>{1}</gml:MultiSurface>"
        "</bldg:lod2MultiSurface></bldg:{0}></bldg:boundedBy>\n",
        kNames[i % 7], gml_member(gml_polygon({rings[i]}, fmt::format("{}_{}", id, i))));
  }
  return fmt::format(
      "<bldg:Building gml:id=\"{}\">{}<bldg:lod2Solid><gml:Solid><gml:exterior><gml:CompositeSurface>{}"
      "</gml:CompositeSurface></gml:exterior></gml:Solid></bldg:lod2Solid>\n{}</bldg:Building>",
      id, more, solid, surfaces);
}

}  // namespace canyon::test
