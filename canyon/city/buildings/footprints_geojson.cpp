#include "canyon/city/buildings/footprints_geojson.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <optional>

#include "canyon/base/json.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/city/meshes/geos.hpp"

namespace canyon::buildings {
namespace {

Json ring_coordinates(const MapRing& ring, double rotation) {
  Json coordinates = Json::array();
  for (std::size_t i = 0; i <= ring.size(); ++i) {
    const LonLat& p = ring[i % ring.size()];
    coordinates.push_back({rounded(p.x() - rotation, 9), rounded(p.y(), 9)});
  }
  return coordinates;
}

/// RFC 7946: rings closed, outer ones counter-clockwise and inner ones clockwise (3.1.6), polygons cut at the
/// antimeridian (3.1.9).
Json geometry_of(const std::vector<MapPolygon>& polygons) {
  namespace geos = meshes::geos;
  Json parts = Json::array();
  for (const MapPolygon& polygon : polygons) {
    if (polygon.outer.size() < 3) continue;
    Eigen::AlignedBox2d bounds;
    // Longitudes must be within +-180 deg; these are relative to the first corner.
    const auto unwrapped = [&](MapRing ring) {
      for (LonLat& p : ring) bounds.extend(p = {longitude_near(p.x(), polygon.outer.front().x()), p.y()});
      return ring;
    };
    std::vector<MapRing> inners;
    const MapRing outer = unwrapped(polygon.outer);
    for (const MapRing& inner : polygon.inners)
      if (inner.size() >= 3) inners.push_back(unwrapped(inner));
    const geos::Geometry whole = geos::polygon(outer, inners);
    const auto add = [&](const GEOSGeometry* shape, double rotation) {
      for (const meshes::Polygon2& part : geos::polygons(shape)) {
        Json rings = Json::array({ring_coordinates(part.outer, rotation)});
        for (const MapRing& hole : part.holes) rings.push_back(ring_coordinates(hole, rotation));
        parts.push_back(std::move(rings));
      }
    };
    if (bounds.min().x() >= -180 && bounds.max().x() <= 180) {
      add(whole.get(), 0);
      continue;
    }
    for (const double rotation : {-360.0, 0.0, 360.0}) {
      const double west = rotation - 180, east = rotation + 180;
      const geos::Geometry side = geos::polygon({{west, -90}, {east, -90}, {east, 90}, {west, 90}});
      add(geos::Geometry(GEOSIntersection_r(geos::context(), whole.get(), side.get())).get(), rotation);
    }
  }
  if (parts.empty()) return nullptr;  // "unlocated": RFC 7946, 3.2
  if (parts.size() == 1) return {{"type", "Polygon"}, {"coordinates", std::move(parts[0])}};
  return {{"type", "MultiPolygon"}, {"coordinates", std::move(parts)}};
}

bool is_foliage(const city::Mesh& mesh, const BuiltFeature& feature) {
  return feature.object_count > 0 && mesh.objects.at(feature.first_object).surface == city::Surface::Foliage;
}

/// The height from the lowest to the highest vertex of a feature's objects.
std::optional<double> measured_height_m(const city::Mesh& mesh, const BuiltFeature& feature) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::uint32_t k = 0; k < feature.object_count; ++k) {
    const city::Object& object = mesh.objects.at(feature.first_object + k);
    for (std::uint32_t t = 0; t < object.triangle_count; ++t) {
      for (const std::uint32_t v : mesh.triangles[object.first_triangle + t]) {
        low = std::min(low, mesh.vertices[v].z());
        high = std::max(high, mesh.vertices[v].z());
      }
    }
  }
  if (!(low <= high)) return std::nullopt;
  return high - low;
}

Json properties_of(const city::Mesh& mesh, const BuiltFeature& feature) {
  Json p{{"id", feature.id},
         {"kind", is_foliage(mesh, feature) ? "foliage"
                  : feature.part            ? "part"
                                            : "building"},
         {"built", feature.built},
         {"reason", feature.reason.empty() ? Json(nullptr) : Json(feature.reason)}};
  for (const char* key : {"height_m", "min_height_m", "height_source", "roof_shape", "roof_height_m",
                          "roof_source", "ground_m", "facade", "roof"})
    p[key] = nullptr;
  if (feature.footprint.empty()) {  // no tags were read: skipped early, or built from ready-made surfaces
    if (const auto height = measured_height_m(mesh, feature)) {
      p["height_m"] = rounded(*height, 3);
      p["height_source"] = "surfaces";
    }
    return p;
  }
  const Shape& shape = feature.shape;
  p["height_m"] = rounded(shape.height_m, 3);
  p["min_height_m"] = rounded(shape.min_height_m, 3);
  p["height_source"] = name(shape.height_source);
  p["roof_shape"] = name(shape.roof);
  p["roof_height_m"] = rounded(shape.roof_height_m, 3);
  // A flat roof's height is not a guess.
  if (shape.roof != RoofShape::Flat) p["roof_source"] = name(shape.roof_source);
  p["ground_m"] = rounded(feature.ground_m, 3);
  p["facade"] = city::material_name(shape.facade);
  p["roof"] = city::material_name(shape.roof_material);
  return p;
}

}  // namespace

std::string format_footprints_geojson(const BuiltCity& built) {
  const city::Mesh& mesh = built.city.mesh;
  std::string text =
      "{\"type\":\"FeatureCollection\",\"name\":" + Json(built.city.name).dump() + ",\"features\":[";
  bool first = true;
  for (const BuiltFeature& feature : built.features) {
    // Buildings are ways and relations; a single node is a tree.
    if (feature.footprint.empty() && (is_foliage(mesh, feature) || feature.id.starts_with("node/"))) continue;
    text += first ? "\n" : ",\n";
    first = false;
    text += Json{{"type", "Feature"},
                 {"id", feature.id},
                 {"properties", properties_of(mesh, feature)},
                 {"geometry", geometry_of(feature.footprint)}}
                .dump();
  }
  text += "\n]}\n";
  return text;
}

void write_footprints_geojson(const std::filesystem::path& path, const BuiltCity& built) {
  OutputFile file(path);
  file.write(format_footprints_geojson(built));
  file.commit();
}

}  // namespace canyon::buildings
