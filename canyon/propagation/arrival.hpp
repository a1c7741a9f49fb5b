#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "canyon/errors/space_delays.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/navigation_data.hpp"
#include "canyon/orbit/sky.hpp"
#include "canyon/propagation/body.hpp"
#include "canyon/propagation/interference.hpp"
#include "canyon/propagation/paths.hpp"
#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::propagation {

/// An antenna at an instant.
struct Antenna {
  geodesy::GpsTime time;                                    ///< true reception instant
  Eigen::Vector3d position_ecef = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d velocity_ecef = Eigen::Vector3d::Zero();  ///< [m/s], in the rotating frame
};

/// A satellite above the horizon as it arrives at an antenna: orbit and surroundings together.
struct SatelliteView {
  orbit::LineOfSight line;
  SatellitePaths paths;
  /// The elevation that a receiver compares with its mask [rad], if not the true one: the
  /// higher of both where a spoofer shows another place.
  std::optional<double> shown_elevation_rad{};
  /// Phase by which the carrier at 1575.42 MHz, but not the code, turns on all paths [rad], and its rate;
  /// other carriers turn by the inverse of their frequency, as in phase scintillation.
  double carrier_turn_rad = 0, carrier_turn_radps = 0;
  /// Errors that the signals carry from space; empty: none beside broadcast orbits, clocks and models.
  std::optional<errors::SpaceDelays> space{};

  /// Rate at which the satellite's direction turns in the axes of the Earth [rad/s].
  [[nodiscard]] double turning_radps() const {
    return line.direction_ecef.cross(line.velocity_at_reception_mps).norm() / line.range_m;
  }
};

/// Everything that arrives at an antenna at one instant.
struct Arrival {
  raytrace::Placement placement = raytrace::Placement::Free;  ///< anything else: nothing is received
  std::vector<SatelliteView> views;  ///< satellites above the horizon, ascending by id
  /// Rotation of the frame that the views' paths are given in.
  Eigen::Matrix3d ecef_from_enu = Eigen::Matrix3d::Identity();
  Eigen::Vector3d antenna_enu = Eigen::Vector3d::Zero();  ///< the antenna in that frame [m]
  double height_above_ground_m = 0;  ///< of the antenna: raytrace::RayScene::height_above_ground()
  /// Other waves at the antenna; powers add.
  std::vector<Interference> interference{};
  /// Orbits and clocks that the satellites broadcast, which the fix uses. Null: the true ones.
  std::shared_ptr<const orbit::Sky> broadcast{};
  /// The messages with these; null: those of the sky.
  std::shared_ptr<const gnss::NavigationData> messages{};
  /// Bodies about the antenna that are not in the city, in the paths' frame, for viewers: the paths include
  /// their effects already.
  std::vector<Body> bodies{};
};

}  // namespace canyon::propagation
