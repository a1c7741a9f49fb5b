#pragma once

#include <Eigen/Core>
#include <cmath>

namespace canyon::positioning {

/// Horizontal protection level [m] that a receiver may state with a fix: K d_major, d_major the larger half
/// axis of the ellipse of its stated standard deviations,
///   d_major^2 = (d_E^2 + d_N^2) / 2 + sqrt(((d_E^2 - d_N^2) / 2)^2 + d_EN^2)
/// (RTCA DO-229D, appendix J.1: HPL_SBAS). It bounds errors as far as they are normal with the covariance
/// that is stated, which reflections are not.
/// @param covariance_enu [m^2], east, north, up: Fix::covariance_enu @param factor K: 6.0 for precision
/// approaches (K_H,PA), 6.18 for en route to non-precision approaches (K_H,NPA)
[[nodiscard]] inline double horizontal_protection_level_m(const Eigen::Matrix3d& covariance_enu,
                                                          double factor) {
  const double middle = 0.5 * (covariance_enu(0, 0) + covariance_enu(1, 1));
  const double half = 0.5 * (covariance_enu(0, 0) - covariance_enu(1, 1));
  return factor * std::sqrt(middle + std::hypot(half, covariance_enu(0, 1)));
}

}  // namespace canyon::positioning
