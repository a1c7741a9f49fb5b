#pragma once

#include <ignition/math/Pose3.hh>
#include <optional>

#include "adapters/gazebo_classic/pose_source.hpp"

namespace canyon::gazebo_classic {

/// Faster than this between two poses is no motion but a jump: a model put elsewhere.
constexpr double kTeleport_mps = 1000;

/// The velocities that lead from one pose to another in `seconds` > 0, in the frame of the poses: along a
/// straight line, about one axis, the shorter way round. Both zero over jumps faster than kTeleport_mps.
/// `pose` of the result is `to`.
[[nodiscard]] TruePose motion_between(const ignition::math::Pose3d& from, const ignition::math::Pose3d& to,
                                      double seconds);

/// `pose` with a unit quaternion. Empty where it is not finite or its quaternion has no direction.
[[nodiscard]] std::optional<ignition::math::Pose3d> proper_pose(const ignition::math::Pose3d& pose);

}  // namespace canyon::gazebo_classic
