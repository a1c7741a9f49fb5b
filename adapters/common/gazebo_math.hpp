#pragma once

#include <Eigen/Geometry>

#include "canyon/simulation/motion/pose_motion.hpp"

namespace canyon::adapters {

/// Converts Pose3d, Quaterniond, Vector3d or Vector2d of Gazebo's mathematics (namespace ignition::math or
/// gz::math) to the engine's types. Normalises a pose's quaternion; non-finite values stay non-finite.
template <class T>
[[nodiscard]] auto eigen(const T& t) {
  if constexpr (requires { t.Rot(); }) {
    Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
    result.linear() = eigen(t.Rot()).normalized().toRotationMatrix();
    result.translation() = eigen(t.Pos());
    return result;
  } else if constexpr (requires { t.W(); }) {
    return Eigen::Quaterniond(t.W(), t.X(), t.Y(), t.Z());
  } else if constexpr (requires { t.Z(); }) {
    return Eigen::Vector3d(t.X(), t.Y(), t.Z());
  } else {
    return Eigen::Vector2d(t.X(), t.Y());
  }
}

template <class Pose>
[[nodiscard]] simulation::RigidPose rigid_pose(const Pose& pose) {
  return {eigen(pose.Pos()), eigen(pose.Rot())};
}

}  // namespace canyon::adapters
