#include "canyon/receiver/positioning/fusion/inertial_errors.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"

namespace canyon::positioning {
namespace {

using Eigen::Vector3d;

const geodesy::Geodetic kMunich = geodesy::Geodetic::from_degrees(48.1, 11.6, 500);

/// Level, forward to the east.
InertialState level_state() {
  InertialState state;
  state.time = geodesy::GpsTime::from_week(2400, 0);
  state.position_m = geodesy::ecef_from_geodetic(kMunich);
  state.ecef_from_body =
      Eigen::Quaterniond(Eigen::Matrix3d(geodesy::enu_from_ecef_rotation(kMunich).transpose()));
  return state;
}
const Vector3d kEarthRotation(0, 0, geodesy::kEarthRotationRate);

TEST(Strapdown, SkewIsTheCrossProduct) {
  const Vector3d a(1, -2, 3), b(0.5, 4, -1);
  EXPECT_EQ(skew(a) * b, a.cross(b));
}

// The readings of a sensor at rest keep it at rest: gravity's reaction and Earth's rotation.
TEST(Strapdown, RestStaysRest) {
  InertialState state = level_state();
  const Vector3d begin = state.position_m, gravity = geodesy::normal_gravity(begin);
  const Eigen::Quaterniond attitude = state.ecef_from_body;
  const ImuReading still{{}, attitude.inverse() * -gravity, attitude.inverse() * kEarthRotation};
  for (int k = 0; k < 6000; ++k) carry(state, still, 0.01, gravity);
  EXPECT_LT((state.position_m - begin).norm(), 1e-6);
  EXPECT_LT(state.velocity_mps.norm(), 1e-7);
  EXPECT_LT(state.ecef_from_body.angularDistance(attitude), 1e-9);
  EXPECT_NEAR(state.time - level_state().time, 60, 1e-6);
}

// A level circle to the left over a short time, on a flat Earth: radius 20 m, 0.5 rad/s, one revolution.
TEST(Strapdown, ACircleCloses) {
  InertialState state = level_state();
  const Vector3d begin = state.position_m, gravity = geodesy::normal_gravity(begin);
  const Eigen::Matrix3d ecef_from_enu = geodesy::enu_from_ecef_rotation(kMunich).transpose();
  constexpr double kRate = 0.5, kSpeed = 10, kStep_s = 0.005;
  state.velocity_mps = ecef_from_enu * Vector3d(kSpeed, 0, 0);
  const int steps = static_cast<int>(std::round(2 * geodesy::kPi / kRate / kStep_s));
  const double dt_s = 2 * geodesy::kPi / kRate / steps;
  for (int k = 0; k < steps; ++k) {
    const Eigen::Matrix3d body_from_ecef = state.rotation().transpose();
    // Centripetal to the left, gravity's reaction, and Coriolis, which the force has to balance.
    const Vector3d felt = Vector3d(0, kRate * kSpeed, 0) +
                          body_from_ecef * (2 * kEarthRotation.cross(state.velocity_mps) - gravity);
    carry(state, {{}, felt, Vector3d(0, 0, kRate) + body_from_ecef * kEarthRotation}, dt_s, gravity);
  }
  EXPECT_LT((state.position_m - begin).norm(), 0.01);
  EXPECT_LT((state.velocity_mps - ecef_from_enu * Vector3d(kSpeed, 0, 0)).norm(), 1e-3);
}

}  // namespace
}  // namespace canyon::positioning
