#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <gazebo/common/Time.hh>
#include <ignition/math/Vector3.hh>

#include "adapters/common/gazebo_math.hpp"

// Gazebo's types and the engine's.

namespace canyon::adapters::gazebo_classic {

[[nodiscard]] inline std::int64_t nanoseconds(const gazebo::common::Time& t) {
  return t.sec * std::int64_t{1'000'000'000} + t.nsec;
}
[[nodiscard]] inline ignition::math::Vector3d ignition_from(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace canyon::adapters::gazebo_classic
