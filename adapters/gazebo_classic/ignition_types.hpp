#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <gazebo/common/Time.hh>
#include <ignition/math/Pose3.hh>

#include "adapters/common/pose_motion.hpp"

// Gazebo's types and the engine's.

namespace canyon::adapters::gazebo_classic {

[[nodiscard]] inline std::int64_t nanoseconds(const gazebo::common::Time& t) {
  return t.sec * std::int64_t{1'000'000'000} + t.nsec;
}
[[nodiscard]] inline Eigen::Vector3d eigen(const ignition::math::Vector3d& v) {
  return {v.X(), v.Y(), v.Z()};
}
[[nodiscard]] inline Eigen::Quaterniond eigen(const ignition::math::Quaterniond& q) {
  return {q.W(), q.X(), q.Y(), q.Z()};
}
[[nodiscard]] inline RigidPose rigid_pose(const ignition::math::Pose3d& pose) {
  return {eigen(pose.Pos()), eigen(pose.Rot())};
}
/// The quaternion is normalised; a pose that is not finite stays so.
[[nodiscard]] inline Eigen::Isometry3d eigen(const ignition::math::Pose3d& pose) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() = eigen(pose.Rot()).normalized().toRotationMatrix();
  result.translation() = eigen(pose.Pos());
  return result;
}
[[nodiscard]] inline ignition::math::Vector3d ignition_from(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace canyon::adapters::gazebo_classic
