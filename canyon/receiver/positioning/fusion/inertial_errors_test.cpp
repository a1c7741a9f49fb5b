#include "canyon/receiver/positioning/fusion/inertial_errors.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>

#include "canyon/base/geodesy/frames.hpp"

namespace canyon::positioning {
namespace {

using Eigen::Vector3d;

const geodesy::Geodetic kPosition = geodesy::Geodetic::from_degrees(-33.9, 151.2, 60);

InertialEstimate moving() {
  InertialEstimate estimate;
  const Eigen::Matrix3d ecef_from_enu = geodesy::enu_from_ecef_rotation(kPosition).transpose();
  estimate.state.position_m = geodesy::ecef_from_geodetic(kPosition);
  estimate.state.velocity_mps = ecef_from_enu * Vector3d(8, -6, 0.5);
  estimate.state.ecef_from_body = Eigen::Quaterniond(
      Eigen::Matrix3d(ecef_from_enu * Eigen::AngleAxisd(-0.64, Vector3d::UnitZ()).toRotationMatrix()));
  estimate.sensors.accelerometer_bias = {0.02, -0.03, 0.01};
  estimate.sensors.gyroscope_bias = {1e-4, 2e-4, -3e-4};
  return estimate;
}

/// The reading of a rotation with an acceleration.
ImuReading reading() {
  ImuReading result;
  result.specific_force_mps2 = {1.2, 2.5, 9.9};
  result.angular_rate_radps = {0.02, -0.03, 0.4};
  return result;
}

SensorMounting quiet_sensors() {
  return {};
}

/// Propagates an estimate by one reading.
void go_on(InertialEstimate& estimate, double dt_s) {
  carry(estimate.state, estimate.sensors.corrected(reading()), dt_s,
        geodesy::normal_gravity(estimate.state.position_m));
}

/// Truth minus estimate, in the order of the errors.
ErrorVector difference(const InertialEstimate& truth, const InertialEstimate& estimate) {
  ErrorVector error;
  const Eigen::AngleAxisd rotation(truth.state.ecef_from_body * estimate.state.ecef_from_body.inverse());
  error << rotation.angle() * rotation.axis(), truth.state.velocity_mps - estimate.state.velocity_mps,
      truth.state.position_m - estimate.state.position_m,
      truth.sensors.accelerometer_bias - estimate.sensors.accelerometer_bias,
      truth.sensors.gyroscope_bias - estimate.sensors.gyroscope_bias,
      truth.sensors.wheel_scale - estimate.sensors.wheel_scale,
      truth.sensors.rotation_scale - estimate.sensors.rotation_scale;
  return error;
}

// Each error grows like the difference of two mechanisations that start with it: covariance of one error.
TEST(InertialErrors, PredictionIsThatOfTheMechanisation) {
  constexpr double kStep_s = 0.01;
  constexpr int kSteps = 100;
  const std::array<double, 6> sizes{1e-5, 1e-3, 1e-1, 1e-4, 1e-6, 1e-4};
  for (int i = 0; i < kInertialErrors; ++i) {
    const double size = sizes[static_cast<std::size_t>(std::min(i / 3, 5))];
    InertialEstimate estimate = moving(), truth = moving();
    switch (i / 3) {
      case 0:
        truth.state.ecef_from_body = rotation_of(size * Vector3d::Unit(i)) * truth.state.ecef_from_body;
        break;
      case 1:
        truth.state.velocity_mps[i - 3] += size;
        break;
      case 2:
        truth.state.position_m[i - 6] += size;
        break;
      case 3:
        truth.sensors.accelerometer_bias[i - 9] += size;
        break;
      case 4:
        truth.sensors.gyroscope_bias[i - 12] += size;
        break;
      default:
        (i == kWheelScale ? truth.sensors.wheel_scale : truth.sensors.rotation_scale) += size;
    }
    estimate.p(i, i) = size * size;
    for (int k = 0; k < kSteps; ++k) {
      const ImuReading motion = estimate.sensors.corrected(reading());
      estimate.predict(motion, kStep_s, geodesy::normal_gravity(estimate.state.position_m), quiet_sensors());
      go_on(estimate, kStep_s);
      go_on(truth, kStep_s);
    }
    // P is the outer product of the error with itself.
    const ErrorVector error = difference(truth, estimate);
    for (int j = 0; j < kInertialErrors; ++j) {
      // Steps of 10 ms to first order; the horizontal gradient of gravity is omitted.
      const int group = j / 3 * 3;
      const double group_norm = error.segment(group, std::min(3, kInertialErrors - group)).norm();
      EXPECT_NEAR(estimate.p(i, j) / error(i), error(j), 0.03 * group_norm + 3e-7 * size / 0.1 + 3e-9)
          << "error " << i << " in " << j;
    }
  }
}

// Scalar update: the gain is P / (P + R).
TEST(InertialErrors, UpdateIsKalmans) {
  InertialEstimate estimate = moving();
  estimate.p(kPositionError, kPositionError) = 4;
  estimate.p(kVelocityError, kVelocityError) = 1;
  estimate.p(kPositionError, kVelocityError) = estimate.p(kVelocityError, kPositionError) = 1;
  const InertialEstimate before = estimate;
  Innovation<1> z;
  z.gradient(0, kPositionError) = 1;
  z.value(0) = 10;
  z.noise(0, 0) = 12;
  EXPECT_NEAR(estimate.distance2(z), 100.0 / 16, 1e-12);
  estimate.take(z);
  EXPECT_NEAR(estimate.state.position_m.x() - before.state.position_m.x(), 10 * 4.0 / 16, 1e-8);
  EXPECT_NEAR(estimate.state.velocity_mps.x() - before.state.velocity_mps.x(), 10 * 1.0 / 16, 1e-12);
  EXPECT_NEAR(estimate.p(kPositionError, kPositionError), 4 - 16.0 / 16, 1e-12);
  EXPECT_NEAR(estimate.p(kVelocityError, kVelocityError), 1 - 1.0 / 16, 1e-12);
}

// Noise of the sensors: a random walk of angle and velocity, and of biases.
TEST(InertialErrors, NoiseGrowsByItsDensity) {
  SensorMounting sensors;
  sensors.gyroscope.white = 1e-4;
  sensors.accelerometer.white = 1e-3;
  sensors.gyroscope.walk = 1e-6;
  InertialEstimate estimate = moving();
  const ImuReading still{{}, Vector3d(0, 0, 9.8), Vector3d::Zero()};
  for (int k = 0; k < 100; ++k)
    estimate.predict(still, 0.01, geodesy::normal_gravity(estimate.state.position_m), sensors);
  EXPECT_NEAR(estimate.p(0, 0), 1e-8, 1e-11);
  EXPECT_NEAR(estimate.p(kGyroscopeBias, kGyroscopeBias), 1e-12, 1e-15);
  const Eigen::Matrix3d velocity = estimate.p.block<3, 3>(kVelocityError, kVelocityError);
  EXPECT_NEAR(velocity.trace(), 3e-6 + 2 * 1e-8 * 9.8 * 9.8 / 3, 1e-7);
}

}  // namespace
}  // namespace canyon::positioning
