#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "canyon/geodesy/frames.hpp"
#include "canyon/options/visitor.hpp"
#include "canyon/simulation/motion/pose_motion.hpp"

namespace canyon::adapters::ros2 {

/// Autoware's map_projector_info.yaml: the place of its frame `map` on the Earth.
struct MapProjectorInfo {
  std::string projector_type;                         ///< MGRS, LocalCartesianUTM or LocalCartesian
  std::string vertical_datum = "WGS84";               ///< WGS84 or EGM2008
  std::string mgrs_grid;                              ///< with MGRS: 54SUE
  std::optional<double> latitude_deg, longitude_deg;  ///< origin, with the others
  double altitude_m = 0;                              ///< of the origin, likewise
};

void visit(options::Visitor& v, MapProjectorInfo& info);
/// Throws InputError naming file, line and cure.
[[nodiscard]] MapProjectorInfo read_map_projector_info(const std::filesystem::path& file);

/// Poses of a projected map in a city's ENU frame. MGRS: east and north of the corner of the square of 100
/// km; LocalCartesianUTM: of the origin, on the grid of its zone; LocalCartesian: in the tangential plane of
/// the origin. Grid north is turned to true north, lengths of the grid become lengths on the ground. Heights
/// over EGM2008 are taken over the geoid of the city.
class MapProjection {
 public:
  /// Throws InputError for an origin outside UTM or a square that there is not.
  MapProjection(const MapProjectorInfo& info, const geodesy::LocalFrame& city, double geoid_undulation_m);

  /// @param pose in the map, x east, y north, z up. Throws InputError outside the zone of UTM.
  [[nodiscard]] simulation::RigidPose in_city(const simulation::RigidPose& pose) const;

 private:
  [[nodiscard]] geodesy::Geodetic geodetic(const Eigen::Vector3d& map) const;

  geodesy::LocalFrame city_;
  std::optional<geodesy::LocalFrame> tangential_;  // LocalCartesian
  geodesy::Utm corner_;                            // the others
  double height_m_ = 0;                            // of the map's z = 0, above the ellipsoid
};

}  // namespace canyon::adapters::ros2
