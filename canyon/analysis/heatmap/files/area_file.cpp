#include "canyon/analysis/heatmap/files/area_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/city/meshes/geos.hpp"

// GeoJSON: RFC 7946. Read with the JSON library instead of OGR's driver, which ignores unknown content.

namespace canyon::heatmap {
namespace {
using Ring = std::vector<Eigen::Vector2d>;
using Polygon = std::vector<Ring>;  ///< the outer ring, then holes

/// A line of GeoJSON is straight in longitude and latitude (RFC 7946, 3.1.1), not in the plane: pieces of at
/// most 500 m are within 500^2 / (8 R) tan(latitude) of it, 5 mm at 45 deg.
constexpr double kPieceMetres = 500;
constexpr double kFarthestMetres = 2e6;  ///< beyond, the tangent plane is too inaccurate
constexpr double kNearMetres = 200e3;

class Reader {
 public:
  Reader(const std::filesystem::path& path, const geodesy::LocalFrame& frame) : path_(path), frame_(frame) {}

  Area read() {
    const TextFile file(path_, std::size_t{1} << 28);
    const Json json = [&] {
      try {
        return Json::parse(file.text());
      } catch (const JsonError& error) {  // also for numbers beyond a double's range
        fail(std::string("is not valid JSON: ") + error.what());
      }
    }();
    if (!json["crs"].is_null()) {
      // RFC 7946, 4, removed this member, but many tools write it.
      const std::string text = json["crs"].dump(-1, Json::Order::ByKey);
      if (text.find("CRS84") == std::string::npos && text.find("4326") == std::string::npos) {
        fail("its coordinates are not WGS 84: " + text.substr(0, 120),
             "convert it with ogr2ogr -t_srs EPSG:4326 -lco RFC7946=YES");
      }
    }
    take(json);
    if (polygons_.empty()) fail("has no polygon", "give Polygon or MultiPolygon features");
    Area area = joined();
    if (area.rings.empty()) fail("its polygons have no area", "give polygons with an interior");
    check_near(area);
    return area;
  }

 private:
  [[noreturn]] void fail(const std::string& problem, const std::string& hint = {}) const {
    throw InputError(path_, 0, problem, hint);
  }

  const Json& member(const Json& object, const char* key) const {
    const Json* found = object.find(key);
    if (found == nullptr) fail(fmt::format("a GeoJSON object has no \"{}\"", key), "see RFC 7946");
    return *found;
  }

  const Json& list(const Json& value, const char* what) const {
    if (!value.is_array()) fail(fmt::format("{} is not a list", what), "see RFC 7946");
    return value;
  }

  /// Reads a file, a feature or a geometry.
  void take(const Json& object) {
    if (!object.is_object()) fail("is not a GeoJSON object", "give a GeoJSON file of polygons");
    const Json& kind = member(object, "type");
    const std::string type = kind.is_string() ? kind.text() : kind.dump();
    if (type == "Feature") {
      const Json& geometry = member(object, "geometry");
      if (!geometry.is_null()) take(geometry);
    } else if (type == "FeatureCollection") {
      for (const Json& feature : list(member(object, "features"), "\"features\"")) take(feature);
    } else if (type == "GeometryCollection") {
      for (const Json& part : list(member(object, "geometries"), "\"geometries\"")) take(part);
    } else if (type == "MultiPolygon") {
      for (const Json& part : list(member(object, "coordinates"), "\"coordinates\"")) take_polygon(part);
    } else if (type == "Polygon") {
      take_polygon(member(object, "coordinates"));
    } else {
      fail(fmt::format("a {} has no area", type), "give Polygon and MultiPolygon features only");
    }
  }

  void take_polygon(const Json& coordinates) {
    Polygon polygon;
    for (const Json& ring : list(coordinates, "a polygon")) polygon.push_back(take_ring(ring));
    if (!polygon.empty()) polygons_.push_back(std::move(polygon));
  }

  [[nodiscard]] Ring take_ring(const Json& positions) const {
    std::vector<Eigen::Vector2d> corners;
    for (const Json& position : list(positions, "a ring of a polygon"))
      corners.push_back(take_position(position));
    if (corners.size() < 4 || corners.front() != corners.back()) {
      fail(fmt::format("a ring of polygon {} has {} positions{}", polygons_.size() + 1, corners.size(),
                       corners.size() < 4 ? "" : " and does not end where it begins"),
           "give at least four positions, the last equal to the first");
    }
    Ring ring;
    for (std::size_t i = 0; i + 1 < corners.size(); ++i) append_line(ring, corners[i], corners[i + 1]);
    return ring;
  }

  [[nodiscard]] Eigen::Vector2d take_position(const Json& position) const {
    if (!position.is_array() || position.size() < 2 || !position[0].is_number() || !position[1].is_number())
      fail("a position is not a list of longitude and latitude", "give [longitude, latitude] in degrees");
    Eigen::Vector2d location(position[0].get<double>(), position[1].get<double>());
    // Beyond 180 deg: some programs do not split polygons at the antimeridian.
    if (!(std::abs(location.x()) <= 360) || !(std::abs(location.y()) <= 90)) {
      fail(fmt::format("[{}, {}] is not a longitude and latitude", location.x(), location.y()),
           "give WGS 84 degrees, the longitude first; convert other systems with ogr2ogr -t_srs EPSG:4326");
    }
    return location;
  }

  [[nodiscard]] Eigen::Vector2d plane_from_degrees(const Eigen::Vector2d& lon_lat) const {
    return frame_
        .local_from_geodetic(
            geodesy::Geodetic::from_degrees(lon_lat.y(), lon_lat.x(), frame_.origin().height_m))
        .head<2>();
  }

  /// Appends `from` and points between `from` and `end`.
  void append_line(Ring& ring, const Eigen::Vector2d& from, const Eigen::Vector2d& end) const {
    // By the shorter arc, also across the antimeridian.
    const Eigen::Vector2d to(from.x() + std::remainder(end.x() - from.x(), 360.0), end.y());
    for (const Eigen::Vector2d& corner : {from, to}) {
      const Eigen::Vector3d location =
          frame_.local_from_geodetic(geodesy::Geodetic::from_degrees(corner.y(), corner.x(), 0));
      if (location.norm() > kFarthestMetres) {
        fail(fmt::format("[{}, {}] is {:.0f} km from the city", corner.x(), corner.y(),
                         location.norm() / 1000),
             "give an area about the city, positions as [longitude, latitude]");
      }
    }
    const double metres = (plane_from_degrees(to) - plane_from_degrees(from)).norm();
    const int pieces = std::max(1, static_cast<int>(std::ceil(metres / kPieceMetres)));
    for (int i = 0; i < pieces; ++i)
      ring.push_back(plane_from_degrees(from + (to - from) * (static_cast<double>(i) / pieces)));
  }

  /// Joins all polygons, since Area's even-odd rule would treat the intersection of two polygons as a hole.
  [[nodiscard]] Area joined() const {
    Area area;
    if (polygons_.size() == 1) {
      area.rings = polygons_.front();
      return area;
    }
    namespace geos = meshes::geos;
    std::vector<geos::Geometry> parts;
    for (const Polygon& polygon : polygons_) {
      geos::Geometry part = geos::polygon(polygon.front(), {polygon.begin() + 1, polygon.end()});
      if (part && GEOSisValid_r(geos::context(), part.get()) != 1)
        part.reset(GEOSMakeValid_r(geos::context(), part.get()));
      if (!part) fail("a polygon crosses itself and cannot be repaired", "repair it in QGIS");
      for (const meshes::Polygon2& piece : geos::polygons(part.get()))
        parts.push_back(geos::polygon(piece.outer, piece.holes));
    }
    const geos::Geometry all = geos::collection(std::move(parts));
    const geos::Geometry one(GEOSUnaryUnion_r(geos::context(), all.get()));
    if (!one) fail("its polygons cannot be joined", "repair them in QGIS");
    for (meshes::Polygon2& polygon : geos::polygons(one.get())) {
      area.rings.push_back(std::move(polygon.outer));
      std::move(polygon.holes.begin(), polygon.holes.end(), std::back_inserter(area.rings));
    }
    return area;
  }

  void check_near(const Area& area) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Ring& ring : area.rings)
      for (const Eigen::Vector2d& point : ring) nearest = std::min(nearest, point.norm());
    if (nearest > kNearMetres && !area.contains(Eigen::Vector2d::Zero())) {
      fail(fmt::format("the area is {:.0f} km from the city", nearest / 1000),
           "give an area about the city, positions as [longitude, latitude]");
    }
  }

  std::filesystem::path path_;
  const geodesy::LocalFrame& frame_;
  std::vector<Polygon> polygons_;
};

}  // namespace

Area read_area(const std::filesystem::path& geojson, const geodesy::LocalFrame& frame) {
  return Reader(geojson, frame).read();
}

}  // namespace canyon::heatmap
