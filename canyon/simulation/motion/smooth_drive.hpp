#pragma once

#include <utility>
#include <vector>

#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {

/// Samples of a smooth drive, at most Trajectory::kSmooth_s apart while it moves: see
/// Trajectory::from_waypoints(). Legs are straight in east, north (about the first waypoint) and height above
/// the ellipsoid. At least two waypoints, checked. Throws InputError for an acceleration out of range, and
/// for a drive of more than 10 million samples.
[[nodiscard]] std::vector<std::pair<geodesy::GpsTime, geodesy::Geodetic>> smooth_samples(
    geodesy::GpsTime start, const std::vector<Waypoint>& waypoints, double acceleration_mps2);

}  // namespace canyon::simulation
