#pragma once

#include <fmt/format.h>

#include <string>

namespace canyon::test {

/// Vertices, in millimetres, of a house of 10 m x 8 m with a gable roof along x: eaves at 6 m, ridge at 9 m.
/// Volume 10 * 8 * 6 + 10 * 8 * 3 / 2 = 600 m^3.
inline const std::string kHouseVertices =
    "[[0,0,0],[10000,0,0],[10000,8000,0],[0,8000,0],[0,0,6000],[10000,0,6000],[10000,8000,6000],[0,8000,6000]"
    ","
    "[0,4000,9000],[10000,4000,9000]]";

/// Its surfaces, front sides outwards: ground, four walls, two halves of the roof.
inline const std::string kHouseSurfaces =
    "[[[0,3,2,1]],[[0,1,5,4]],[[1,2,6,9,5]],[[2,3,7,6]],[[3,0,4,8,7]],[[4,5,9,8]],[[6,7,8,9]]]";

inline const std::string kHouseSemantics =
    R"({"surfaces":[{"type":"GroundSurface"},{"type":"WallSurface"},{"type":"RoofSurface"}],)"
    R"("values":[[0,1,1,1,1,2,2]]})";

/// An LoD 2 solid of the house as a CityJSON geometry.
inline const std::string kHouseSolid = fmt::format(
    R"({{"type":"Solid","lod":"2","boundaries":[{}],"semantics":{}}})", kHouseSurfaces, kHouseSemantics);

/// A CityJSON file. `objects` are the members of CityObjects; `translate` is the position of the house's
/// corner.
inline std::string cityjson(const std::string& objects, const std::string& reference = "EPSG/0/25832",
                            const std::string& translate = "691000,5334000,500",
                            const std::string& version = "2.0",
                            const std::string& scale = "0.001,0.001,0.001") {
  return fmt::format(R"({{"type":"CityJSON","version":"{}","transform":{{"scale":[{}],"translate":[{}]}},)"
                     R"("metadata":{{"referenceSystem":"https://www.opengis.net/def/crs/{}"}},)"
                     "\n"
                     R"("CityObjects":{{{}}},)"
                     "\n"
                     R"("vertices":{}}})",
                     version, scale, translate, reference, objects, kHouseVertices);
}

/// A Building of that name with one geometry.
inline std::string cityjson_building(const std::string& key, const std::string& geometry,
                                     const std::string& attributes = "{}") {
  return fmt::format(R"("{}":{{"type":"Building","attributes":{},"geometry":[{}]}})", key, attributes,
                     geometry);
}

}  // namespace canyon::test
