#include "canyon/buildings/footprints_geojson.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "canyon/base/json.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/rounded.hpp"
#include "canyon/city/mesh_marks.hpp"

namespace canyon::buildings {
namespace {

/// Twice the signed area [deg^2], about the first corner so that small rings keep their digits; positive when
/// counter-clockwise.
double turning(const MapRing& ring) {
  double sum = 0;
  for (std::size_t i = 2; i < ring.size(); ++i) {
    const LonLat a = ring[i - 1] - ring[0], b = ring[i] - ring[0];
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return sum;
}

/// RFC 7946, 3.1.6: closed, the outer ring counter-clockwise, inner ones clockwise.
Json ring_coordinates(const MapRing& ring, bool outer) {
  MapRing turned = ring;
  if ((turning(ring) > 0) != outer) std::reverse(turned.begin(), turned.end());
  turned.push_back(turned.front());
  Json coordinates = Json::array();
  for (const LonLat& p : turned) coordinates.push_back({rounded(p.x(), 9), rounded(p.y(), 9)});
  return coordinates;
}

/// RFC 7946, 3.1.9: a polygon across the antimeridian as its two sides.
std::vector<MapPolygon> cut_at_antimeridian(const MapPolygon& polygon) {
  constexpr double kUnits = 1e6;  // of a degree, so that the millimetres of intersect() are 1e-9 deg
  const double first = polygon.outer.front().x();
  double farthest = 0;
  const auto plane = [&](const MapRing& ring) {
    std::vector<Point2> points;
    for (const LonLat& p : ring) {
      points.push_back(kUnits * LonLat(longitude_near(p.x(), first), p.y()));
      farthest = std::max(farthest, std::abs(points.back().x()));
    }
    return points;
  };
  Polygon2 whole{plane(polygon.outer), {}};
  for (const MapRing& inner : polygon.inners) whole.holes.push_back(plane(inner));
  if (farthest <= 180 * kUnits) return {polygon};
  std::vector<MapPolygon> sides;
  for (const double middle : {std::copysign(90.0, first), std::copysign(270.0, first)}) {
    const Point2 low = kUnits * LonLat(middle - 90, -90), high = kUnits * LonLat(middle + 90, 90);
    const Polygon2 side{{low, {high.x(), low.y()}, high, {low.x(), high.y()}}, {}};
    const LonLat turns(longitude_near(middle, 0) - middle, 0);
    const auto ring = [&](const std::vector<Point2>& points) {
      MapRing out;
      for (const Point2& p : points) out.push_back(p / kUnits + turns);
      return out;
    };
    for (const Polygon2& piece : intersect({whole}, {side})) {
      MapPolygon& next = sides.emplace_back();
      next.outer = ring(piece.outer);
      for (const auto& hole : piece.holes) next.inners.push_back(ring(hole));
    }
  }
  return sides;
}

Json geometry_of(const std::vector<MapPolygon>& polygons) {
  std::vector<MapPolygon> sides;
  for (const MapPolygon& polygon : polygons) {
    if (polygon.outer.size() < 3) continue;
    const std::vector<MapPolygon> cut = cut_at_antimeridian(polygon);
    sides.insert(sides.end(), cut.begin(), cut.end());
  }
  Json parts = Json::array();
  for (const MapPolygon& polygon : sides) {
    Json rings = Json::array({ring_coordinates(polygon.outer, true)});
    for (const MapRing& inner : polygon.inners) {
      if (inner.size() >= 3) rings.push_back(ring_coordinates(inner, false));
    }
    parts.push_back(std::move(rings));
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
                          "roof_source", "ground_m", "facade", "roof"}) {
    p[key] = nullptr;
  }
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

/// Buildings are ways and relations; a lone node is a tree.
bool is_tree(const city::Mesh& mesh, const BuiltFeature& feature) {
  return feature.footprint.empty() && (is_foliage(mesh, feature) || feature.id.rfind("node/", 0) == 0);
}

}  // namespace

std::string format_footprints_geojson(const BuiltCity& built) {
  const city::Mesh& mesh = built.city.mesh;
  std::string text =
      "{\"type\":\"FeatureCollection\",\"name\":" + Json(built.city.name).dump() + ",\"features\":[";
  bool first = true;
  for (const BuiltFeature& feature : built.features) {
    if (is_tree(mesh, feature)) continue;
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
