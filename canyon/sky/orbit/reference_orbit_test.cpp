#include "canyon/sky/orbit/precise_sky.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"

namespace canyon::orbit {
namespace {

using Eigen::Vector3d;
using geodesy::GpsTime;

constexpr double kMu = 3.986004418e14;
const GpsTime kEpoch = GpsTime::from_week(2100, 1000);
// The size and eccentricity of Galileo's two eccentric satellites, at an asymmetric position.
const Vector3d kPosition(17'000e3, -14'000e3, 9'000e3);
const Vector3d kVelocity(2'300, 2'700, 2'050);

TEST(ReferenceOrbit, PassesThroughItsState) {
  const ReferenceOrbit orbit(kEpoch, kPosition, kVelocity);
  const ReferenceOrbit::State s = orbit.at(kEpoch);
  EXPECT_LT((s.position_m - kPosition).norm(), 1e-6);
  // The rotation of the orbit by J2 adds centimetres a second to the velocity of the ellipse.
  EXPECT_LT((s.velocity_mps - kVelocity).norm(), 0.5);
}

TEST(ReferenceOrbit, VelocityAndAnomalyRateAreDerivatives) {
  const ReferenceOrbit orbit(kEpoch, kPosition, kVelocity);
  double before = orbit.at(kEpoch - 90'000.0).true_anomaly_rad;
  for (double dt = -86'400; dt <= 86'400; dt += 1234.5) {
    const ReferenceOrbit::State s = orbit.at(kEpoch + dt);
    const ReferenceOrbit::State earlier = orbit.at(kEpoch + dt - 1.0);
    const ReferenceOrbit::State later = orbit.at(kEpoch + dt + 1.0);
    // Central difference over 2 s: third derivative / 6, below 1e-8 of the velocity.
    EXPECT_LT(((later.position_m - earlier.position_m) / 2 - s.velocity_mps).norm(), 1e-4);
    EXPECT_NEAR((later.true_anomaly_rad - earlier.true_anomaly_rad) / 2, s.true_anomaly_rate, 1e-10);
    EXPECT_GT(s.true_anomaly_rad, before);
    before = s.true_anomaly_rad;
  }
}

TEST(ReferenceOrbit, TurnsAsJ2Says) {
  const ReferenceOrbit orbit(kEpoch, kPosition, kVelocity);
  const double a = 1 / (2 / kPosition.norm() - kVelocity.squaredNorm() / kMu);
  const double period = 2 * geodesy::kPi * std::sqrt(a * a * a / kMu);
  const Vector3d h0 = kPosition.cross(kVelocity);
  const double e = (kVelocity.cross(h0) / kMu - kPosition.normalized()).norm();
  // Vallado, eq. 9-37, per revolution: -3 pi J2 (R/p)^2 cos i.
  const double p = a * (1 - e * e);
  const double rotation = -3 * geodesy::kPi * 1.08262668e-3 * std::pow(6'378'137 / p, 2) * h0.z() / h0.norm();
  // The normal of the plane, from three positions of a later revolution.
  const auto normal = [&](double t) {
    return Vector3d(
        orbit.at(kEpoch + t).position_m.cross(orbit.at(kEpoch + (t + 1.0)).position_m).normalized());
  };
  const Vector3d before = normal(0);
  const Vector3d after = normal(100 * period);
  const double rotated = std::atan2(after.y(), after.x()) - std::atan2(before.y(), before.x());
  EXPECT_NEAR(std::remainder(rotated, 2 * geodesy::kPi), 100 * rotation, 1e-3 * std::abs(100 * rotation));
}

TEST(ReferenceOrbit, ScaledMeanMotionComesBackSooner) {
  ReferenceOrbit orbit(kEpoch, kPosition, kVelocity);
  const double rate = orbit.at(kEpoch).true_anomaly_rate;
  orbit.scale_mean_motion(1.001);
  EXPECT_NEAR(orbit.at(kEpoch).true_anomaly_rate / rate, 1.001, 1e-12);
  EXPECT_LT((orbit.at(kEpoch).position_m - kPosition).norm(), 1e-6);
}

TEST(ReferenceOrbit, CirclesAndEquatorsAreNoExceptions) {
  const double r = 42'164e3;
  const double v = std::sqrt(kMu / r);
  const ReferenceOrbit orbit(kEpoch, {0, r, 0}, {-v, 0, 0});
  for (double dt = 0; dt < 86'400; dt += 3600) {
    const ReferenceOrbit::State s = orbit.at(kEpoch + dt);
    EXPECT_NEAR(s.position_m.norm(), r, 1e-3);
    EXPECT_NEAR(s.position_m.z(), 0, 1e-6);
  }
}

TEST(ReferenceOrbit, WhatIsNoEllipseSubtractsNothing) {
  for (const Vector3d& velocity : {Vector3d(0, 0, 0), Vector3d(0, 9'000, 0), Vector3d(std::nan(""), 0, 0)}) {
    const ReferenceOrbit orbit(kEpoch, {26'000e3, 0, 0}, velocity);
    EXPECT_EQ(orbit.at(kEpoch + 100.0).position_m, Vector3d::Zero());
    EXPECT_GT(orbit.at(kEpoch + 100.0).true_anomaly_rad, orbit.at(kEpoch).true_anomaly_rad);
  }
  EXPECT_EQ(ReferenceOrbit(kEpoch, Vector3d::Zero(), Vector3d::Zero()).at(kEpoch).velocity_mps,
            Vector3d::Zero());
}

}  // namespace
}  // namespace canyon::orbit
