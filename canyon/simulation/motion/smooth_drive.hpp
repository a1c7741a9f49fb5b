#pragma once

#include <vector>

#include "canyon/simulation/motion/smooth_motion.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {

/// A drive in seconds from its start.
struct SmoothDrive {
  SmoothMotion motion;  ///< in the local frame of the first waypoint; empty if all are at one position
  double duration_s = 0, length_m = 0;
};

/// See Trajectory::from_waypoints(). Legs are straight in east, north (about the first waypoint) and height
/// above the ellipsoid. At least two waypoints, checked. Throws InputError for an acceleration out of range,
/// and if the drive is in motion for more than 11 days.
[[nodiscard]] SmoothDrive smooth_drive(const std::vector<Waypoint>& waypoints, double acceleration_mps2);

}  // namespace canyon::simulation
