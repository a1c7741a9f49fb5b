#pragma once

#include <Eigen/Geometry>
#include <gz/math/Pose3.hh>

#include "adapters/common/pose_motion.hpp"

// Gazebo Sim's types and the engine's.

namespace canyon::adapters::gz_sim {

[[nodiscard]] inline Eigen::Vector3d eigen(const gz::math::Vector3d& v) {
  return {v.X(), v.Y(), v.Z()};
}
[[nodiscard]] inline RigidPose rigid_pose(const gz::math::Pose3d& pose) {
  const gz::math::Quaterniond& q = pose.Rot();
  return {eigen(pose.Pos()), {q.W(), q.X(), q.Y(), q.Z()}};
}

}  // namespace canyon::adapters::gz_sim
