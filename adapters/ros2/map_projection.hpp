#pragma once

#include <Eigen/Core>
#include <GeographicLib/TransverseMercator.hpp>
#include <filesystem>
#include <optional>
#include <string>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/simulation/motion/pose_motion.hpp"

namespace canyon::adapters::ros2 {

inline constexpr double kUtmScale = 0.9996;

/// Autoware's map_projector_info.yaml: the position of its frame `map` on the Earth.
struct MapProjectorInfo {
  std::string projector_type;            ///< MGRS, LocalCartesianUTM, LocalCartesian, TransverseMercator
  std::string vertical_datum = "WGS84";  ///< WGS84 or EGM2008
  std::string mgrs_grid;                 ///< with MGRS: 54SUE
  std::optional<double> latitude_deg, longitude_deg;  ///< origin, with the others
  double scale_factor = kUtmScale;                    ///< on the origin's meridian, with TransverseMercator
};

void visit(options::Visitor& v, MapProjectorInfo& info);
/// Throws InputError naming file, line and hint.
[[nodiscard]] MapProjectorInfo read_map_projector_info(const std::filesystem::path& file);

/// Poses of a projected map in a city's ENU frame. MGRS: east and north of the corner of the square of 100
/// km; LocalCartesianUTM: of the origin, on the grid of its zone; LocalCartesian: in the tangential plane of
/// the origin; TransverseMercator: of the origin, on a grid around its meridian. Grid north is rotated to
/// true north, grid lengths are converted to lengths on the ground. Heights above EGM2008 are treated as
/// above the geoid of the city.
class MapProjection {
 public:
  /// Throws InputError for an origin outside UTM or a non-existent square.
  MapProjection(const MapProjectorInfo& info, const geodesy::LocalFrame& city, double geoid_undulation_m);

  /// @param pose in the map, x east, y north, z up
  [[nodiscard]] simulation::RigidPose in_city(const simulation::RigidPose& pose) const;

 private:
  void begin_at(const geodesy::Utm& utm);

  geodesy::LocalFrame city_;
  std::optional<geodesy::LocalFrame> tangential_;          // LocalCartesian
  std::optional<GeographicLib::TransverseMercator> grid_;  // the others
  double meridian_deg_ = 0;                                // of the grid
  Eigen::Vector2d begin_ = Eigen::Vector2d::Zero();  // the map's origin from the meridian and the equator [m]
  double height_m_ = 0;                              // of the map's z = 0, above the ellipsoid
};

}  // namespace canyon::adapters::ros2
