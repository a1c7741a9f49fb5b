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
  /// What the carrier at 1575.42 MHz turns by on its way, the code not, on all paths [rad], and its rate; of
  /// other carriers by the inverse of their frequency, as phase scintillation is.
  double carrier_turn_rad = 0, carrier_turn_radps = 0;
  /// What the signals carry from space; empty: what broadcast orbits, clocks and models say.
  std::optional<errors::SpaceDelays> space{};

  /// Rate at which the satellite's direction turns in the axes of the Earth [rad/s].
  [[nodiscard]] double turning_radps() const {
    return line.direction_ecef.cross(line.velocity_at_reception_mps).norm() / line.range_m;
  }
};

/// What arrives at an antenna at one instant.
struct Arrival {
  raytrace::Placement placement = raytrace::Placement::Free;  ///< anything else: nothing is received
  std::vector<SatelliteView> views;  ///< satellites above the horizon, ascending by id
  /// Rotation of the frame that the views' paths are given in.
  Eigen::Matrix3d ecef_from_enu = Eigen::Matrix3d::Identity();
  Eigen::Vector3d antenna_enu = Eigen::Vector3d::Zero();  ///< the antenna in that frame [m]
  /// What else comes to the antenna; powers add.
  std::vector<Interference> interference{};
  /// What the satellites say of themselves: the fix goes by it. Null: the truth.
  std::shared_ptr<const orbit::Sky> broadcast{};
  /// The messages that say so; null: those of the sky.
  std::shared_ptr<const gnss::NavigationData> messages{};
  /// What stands or moves about the antenna and is not in the city, in the paths' frame, for viewers: the
  /// paths include its effects already.
  std::vector<Body> bodies{};
};

}  // namespace canyon::propagation
