#include "canyon/geodesy/covariance.hpp"

namespace canyon::geodesy {

Eigen::Matrix3d rotated(const Eigen::Matrix3d& rotation, const Eigen::Matrix3d& covariance) {
  return rotation * covariance * rotation.transpose();
}

}  // namespace canyon::geodesy
