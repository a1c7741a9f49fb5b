#pragma once

#include <Eigen/Core>

namespace canyon::geodesy {

/// R C R^T: covariance in axes that `rotation` R turns those of `covariance` C into. Compiled once: Eigen's
/// product takes half a second for each kind of operand.
[[nodiscard]] Eigen::Matrix3d rotated(const Eigen::Matrix3d& rotation, const Eigen::Matrix3d& covariance);

}  // namespace canyon::geodesy
