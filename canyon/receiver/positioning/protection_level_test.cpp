#include "canyon/receiver/positioning/least_squares.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace canyon::positioning {
namespace {

// The semi-major axis is the root of the larger eigenvalue, for any rotation of the ellipse: of 4 m by 2 m it
// is 4 m, and the level 6 times that.
TEST(ProtectionLevel, IsTheLargerHalfAxisTimesTheFactor) {
  const Eigen::Matrix3d ellipse = Eigen::Vector3d(16, 4, 900).asDiagonal();
  for (const double rotation : {0.0, 0.3, 1.2, 2.5}) {
    const Eigen::Matrix3d rotated = Eigen::AngleAxisd(rotation, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    EXPECT_NEAR(horizontal_protection_level_m(rotated * ellipse * rotated.transpose(), 6), 24, 1e-12);
  }
  EXPECT_NEAR(horizontal_protection_level_m(9 * Eigen::Matrix3d::Identity(), 6.18), 3 * 6.18, 1e-12);
}

// With d_E = 3, d_N = 2, d_EN = 1 by hand: (9 + 4) / 2 + sqrt(2.5^2 + 1) = 9.19258.
TEST(ProtectionLevel, OfCorrelatedAxes) {
  Eigen::Matrix3d covariance = Eigen::Vector3d(9, 4, 1).asDiagonal();
  covariance(0, 1) = covariance(1, 0) = 1;
  EXPECT_NEAR(horizontal_protection_level_m(covariance, 1), std::sqrt(9.19258240356725), 1e-12);
}

}  // namespace
}  // namespace canyon::positioning
