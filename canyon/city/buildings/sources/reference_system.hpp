#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/city/buildings/sources/gdal.hpp"
#include "canyon/city/buildings/sources/geoid.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"

namespace canyon::buildings {

/// GDAL's name for OGC's name of a reference system: "https://www.opengis.net/def/crs/EPSG/0/7415",
/// "urn:ogc:def:crs:EPSG::7415", "EPSG:7415" give "EPSG:7415"; two of them in one name (crs-compound) give
/// "EPSG:28992+5709"; OGC's CRS84 and CRS84h are EPSG:4326 and EPSG:4979; the names of Germany's surveying
/// authorities, "urn:adv:crs:ETRS89_UTM32*DE_DHHN2016_NH", likewise ("EPSG:25832+7837"). Else empty.
[[nodiscard]] std::string reference_name(std::string_view ogc_name);

/// Converts coordinates of a file to WGS 84. East (or longitude) comes first and north second, independent of
/// the authority's axis order, which north_first() returns.
class ReferenceSystem {
 public:
  /// @param name for GDAL, as reference_name() gives it
  /// Heights: by Geoid, and as ellipsoidal if their geoid is not available (with a note); without a vertical
  /// part they are in the unit of a projected system, else in metres. Throws InputError for a system that
  /// PROJ does not know or that is neither projected nor geographic.
  ReferenceSystem(const std::filesystem::path& file, const std::string& name, const TerrainOptions& options);

  /// Converts in place: x, y, z to longitude, latitude [deg], ellipsoidal height [m]; NaN if PROJ has no
  /// result (outside the projection's range).
  void to_wgs84(std::vector<Eigen::Vector3d>& points) const;

  /// Whether a point of the file, east first, has a position on the Earth in the area of use.
  [[nodiscard]] bool finds(const Eigen::Vector2d& point) const;

  /// Whether a position is in the system's area of use (from EPSG), or within a degree of it; true if the
  /// area is not known.
  [[nodiscard]] bool in_area_of_use(const LonLat& location) const;

  [[nodiscard]] const Geoid& geoid() const { return *geoid_; }
  [[nodiscard]] bool geographic() const { return geographic_; }
  /// Whether the authority (EPSG) lists north, or latitude, before east.
  [[nodiscard]] bool north_first() const { return north_first_; }
  /// The name of the system with that of its heights, "JGD2011 + JGD2011 (vertical) height".
  [[nodiscard]] const std::string& title() const { return title_; }
  [[nodiscard]] const ReadReport& notes() const { return notes_; }

 private:
  void plane_to_wgs84(std::vector<double>& x, std::vector<double>& y, std::vector<int>& ok) const;

  gdal::Transformation wgs84_from_map_;  ///< null if the coordinates are longitude and latitude already
  std::optional<Geoid> geoid_;
  std::optional<LonLatBox> area_of_use_;
  bool geographic_ = false, north_first_ = false;
  std::string title_;
  ReadReport notes_;
};

}  // namespace canyon::buildings
