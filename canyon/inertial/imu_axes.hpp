#pragma once

#include <Eigen/Core>

#include "canyon/inertial/imu_options.hpp"

namespace canyon::inertial {

/// A vector of some axes in others.
[[nodiscard]] inline Eigen::Vector3d in_axes(const Eigen::Vector3d& v, ImuAxes from, ImuAxes to) {
  return from == to ? v : Eigen::Vector3d(v.x(), -v.y(), -v.z());
}

}  // namespace canyon::inertial
