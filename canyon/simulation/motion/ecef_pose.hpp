#pragma once

#include <Eigen/Core>

#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {

/// From the vehicle's axes (forward, left, up) to east, north, up at its place, by yaw, pitch and roll.
[[nodiscard]] Eigen::Matrix3d enu_from_body(const Pose& pose);

/// geodesy::enu_from_ecef_rotation() at a point in ECEF [m], without its geodetic coordinates: the
/// ellipsoid's normal by one step of Bowring (Transformation from spatial to geographical coordinates, Survey
/// Review 23, 1976). Within 1e-12 below 10 km of height. The point is not on the Earth's axis.
[[nodiscard]] Eigen::Matrix3d enu_from_ecef_at(const Eigen::Vector3d& ecef_m);

}  // namespace canyon::simulation
