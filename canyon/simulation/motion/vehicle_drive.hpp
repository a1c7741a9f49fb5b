#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {

/// A vehicle's reference point in the world's frame (z up) at an instant.
struct DrivePose {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  double yaw_rad = 0;         ///< direction of travel, from the x axis counter-clockwise; held at standstill
  double yaw_rate_radps = 0;  ///< counter-clockwise
};

/// The path of a vehicle on rails as a function of a world's time. Immutable.
class VehicleDrive {
 public:
  struct WaypointOptions {
    double speed_mps = 10;  ///< (0, 1e5]
    double hold_s = 0;      ///< standstill at each waypoint, the first one included; [0, 1e8]
    bool loop = false;      ///< from the last waypoint straight back to the first, repeatedly
  };
  /// Straight legs between points of the world [m]. Throws InputError if there is no waypoint, a waypoint is
  /// not finite, or an option is out of range.
  [[nodiscard]] static VehicleDrive along_waypoints(const std::vector<Eigen::Vector3d>& waypoints_m,
                                                    const WaypointOptions& options);

  /// Over the Earth: `trajectory.at(start + seconds)` in `world`, whose heading is that of its x axis.
  /// `loop`: jumps from its end back to its begin. Throws InputError if `start` is after the trajectory's
  /// end, or the trajectory is more than 100 km from the world's origin.
  [[nodiscard]] static VehicleDrive along_trajectory(const Trajectory& trajectory, geodesy::GpsTime start,
                                                     const geodesy::LocalFrame& world, bool loop);

  /// The pose at finite `seconds` of the world's time. Before the begin and after the end, unless it loops,
  /// the vehicle is stationary at its first or last position.
  [[nodiscard]] DrivePose at(double seconds) const;
  /// First world time at the last position [s]; with `loop` the period, counted from begin_s().
  [[nodiscard]] double end_s() const { return end_s_; }
  [[nodiscard]] double begin_s() const { return begin_s_; }

 private:
  struct Stop {
    double time_s;
    Eigen::Vector3d position_m;
    double yaw_rad;  // of the leg that starts here, or held
  };
  struct Geodetic {
    Trajectory trajectory;
    geodesy::GpsTime start;
    geodesy::LocalFrame world;
  };

  VehicleDrive() = default;
  [[nodiscard]] DrivePose between_stops(double seconds) const;
  [[nodiscard]] DrivePose on_earth(double seconds) const;

  std::vector<Stop> stops_;
  std::optional<Geodetic> geodetic_;
  double begin_s_ = 0;
  double end_s_ = 0;
  bool loop_ = false;
};

}  // namespace canyon::simulation
