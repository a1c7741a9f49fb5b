#include "canyon/positioning/fusion/vehicle_constraints.hpp"

#include "canyon/geodesy/constants.hpp"

namespace canyon::positioning {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

const Vector3d kEarth(0, 0, geodesy::kEarthRotationRate);
/// Slips and slides last about so long [s].
constexpr double kSlide_s = 1;

double square(double value) {
  return value * value;
}

}  // namespace

Vector3d VehicleConstraints::rate(const InertialEstimate& estimate) const {
  return felt_radps_ - estimate.state.rotation().transpose() * kEarth;
}

Vector3d VehicleConstraints::axle_velocity(const InertialEstimate& estimate) const {
  return estimate.state.rotation().transpose() * estimate.state.velocity_mps +
         rate(estimate).cross(mounting_.axle_m);
}

Eigen::Matrix<double, 3, kInertialErrors> VehicleConstraints::axle_gradient(
    const InertialEstimate& estimate) const {
  const Matrix3d body_from_ecef = estimate.state.rotation().transpose();
  Eigen::Matrix<double, 3, kInertialErrors> gradient = Eigen::Matrix<double, 3, kInertialErrors>::Zero();
  gradient.block<3, 3>(0, kVelocityError) = body_from_ecef;
  gradient.block<3, 3>(0, kAttitudeError) = body_from_ecef * skew(estimate.state.velocity_mps);
  gradient.block<3, 3>(0, kGyroscopeBias) = skew(mounting_.axle_m);
  return gradient;
}

void VehicleConstraints::move(const InertialEstimate& estimate, const FeltMotion& felt, double dt_s) {
  felt_radps_ = felt.angular_rate_radps;
  way_m_ += axle_velocity(estimate).x() * dt_s;
  moved_s_ += dt_s;
}

void VehicleConstraints::take_wheels(InertialEstimate& estimate, const WheelReading& reading) {
  if (moved_s_ <= 0) return;
  const double mean_mps = way_m_ / moved_s_;
  way_m_ = moved_s_ = 0;
  const WheelModel& wheels = *mounting_.wheels;
  const double scale = 1 + estimate.sensors.wheel_scale;
  const double sign = !wheels.direction && mean_mps < 0 ? -1 : 1;
  Innovation<1> z;
  z.value(0) = sign * reading.speed_mps - scale * mean_mps;
  z.gradient = scale * axle_gradient(estimate).row(0);
  z.gradient(0, kWheelScale) = mean_mps;
  // Slip lasts; two readings share the tick between them (the variance of a difference of two steps).
  const double slip = wheels.slip * mean_mps;
  z.noise(0, 0) =
      square(slip) * (1 + 2 * wheels.slip_time_s / reading.dt_s) + square(wheels.step_mps) / 6 + square(0.02);
  estimate.take(z);
}

void VehicleConstraints::take_way(InertialEstimate& estimate, double since_s) const {
  const Vector3d velocity = axle_velocity(estimate);
  Innovation<2> z;
  z.value = -velocity.tail<2>();
  z.gradient = axle_gradient(estimate).bottomRows<2>();
  const double lasts = kSlide_s / since_s;
  z.noise(0, 0) = square(options_.sideways_mps) * lasts;
  z.noise(1, 1) = square(options_.upwards_mps) * lasts;
  estimate.take(z);
}

void VehicleConstraints::take_rest(InertialEstimate& estimate, const ImuReading& mean, double since_s) const {
  constexpr double kStill_mps = 0.02, kStill_radps = 1e-4;
  const double lasts = kSlide_s / since_s;
  Innovation<3> velocity;
  velocity.value = -estimate.state.velocity_mps;
  velocity.gradient.block<3, 3>(0, kVelocityError).setIdentity();
  velocity.noise = square(kStill_mps) * Matrix3d::Identity();
  estimate.take(velocity);
  // A gyroscope at rest feels its bias and Earth's rotation.
  Innovation<3> turn;
  turn.value = mean.angular_rate_radps - estimate.sensors.gyroscope_bias -
               estimate.state.rotation().transpose() * kEarth;
  turn.gradient.block<3, 3>(0, kGyroscopeBias).setIdentity();
  turn.noise = (square(mounting_.gyroscope.white) + square(kStill_radps)) * lasts * Matrix3d::Identity();
  estimate.take(turn);
}

}  // namespace canyon::positioning
