#include "canyon/receiver/positioning/fusion/vehicle_constraints.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"

namespace canyon::positioning {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

const Vector3d kEarth(0, 0, geodesy::kEarthRotationRate);
/// Correlation time of wheel slip and sideslip [s].
constexpr double kSlide_s = 1;

double square(double value) {
  return value * value;
}

}  // namespace

Vector3d VehicleConstraints::rate(const InertialEstimate& estimate) const {
  return rate_radps_ - estimate.state.rotation().transpose() * kEarth;
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

void VehicleConstraints::move(const InertialEstimate& estimate, const ImuReading& motion, double dt_s) {
  rate_radps_ = motion.angular_rate_radps;
  travelled_m_ += axle_velocity(estimate).x() * dt_s;
  moved_s_ += dt_s;
}

void VehicleConstraints::take_wheels(InertialEstimate& estimate, const WheelReading& reading) {
  if (moved_s_ <= 0) return;
  const double mean_mps = travelled_m_ / moved_s_;
  travelled_m_ = moved_s_ = 0;
  const WheelModel& wheels = *mounting_.wheels;
  const double scale = 1 + estimate.sensors.wheel_scale;
  const double sign = !wheels.direction && mean_mps < 0 ? -1 : 1;
  Innovation<1> z;
  z.value(0) = sign * reading.speed_mps - scale * mean_mps;
  z.gradient = scale * axle_gradient(estimate).row(0);
  z.gradient(0, kWheelScale) = mean_mps;
  // Slip is correlated; two readings have a common tick (the variance of a difference of two steps).
  const double slip = wheels.slip * mean_mps;
  z.noise(0, 0) =
      square(slip) * (1 + 2 * wheels.slip_time_s / reading.dt_s) + square(wheels.step_mps) / 6 + square(0.02);
  estimate.take(z);
}

void VehicleConstraints::apply_non_holonomic(InertialEstimate& estimate, double since_s) const {
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
  // A gyroscope at rest measures its bias and Earth's rotation.
  Innovation<3> rotation_angle;
  rotation_angle.value = mean.angular_rate_radps - estimate.sensors.gyroscope_bias -
                         estimate.state.rotation().transpose() * kEarth;
  rotation_angle.gradient.block<3, 3>(0, kGyroscopeBias).setIdentity();
  rotation_angle.noise =
      (square(mounting_.gyroscope.white) + square(kStill_radps)) * lasts * Matrix3d::Identity();
  estimate.take(rotation_angle);
}

StandstillDetector::StandstillDetector(const SensorMounting& mounting)
    : window_(static_cast<std::size_t>(std::max(2.0, std::round(1 / mounting.imu_interval_s)))),
      has_wheels_(mounting.wheels.has_value()) {
  // Three times the noise of a sample, and the minimum vibration of a motor.
  const double per_sample = 3 / std::sqrt(mounting.imu_interval_s);
  force_limit_ = std::max(0.03, per_sample * mounting.accelerometer.white);
  rate_limit_ = std::max(0.003, per_sample * mounting.gyroscope.white);
}

void StandstillDetector::add(const ImuReading& reading) {
  const auto count = [this](const ImuReading& r, double sign) {
    force_ += sign * r.specific_force_mps2;
    rate_ += sign * r.angular_rate_radps;
    force2_ += sign * r.specific_force_mps2.cwiseAbs2();
    rate2_ += sign * r.angular_rate_radps.cwiseAbs2();
  };
  readings_.push_back(reading);
  count(reading, 1);
  if (readings_.size() <= window_) return;
  count(readings_.front(), -1);
  readings_.pop_front();
}

void StandstillDetector::add(const WheelReading& reading) {
  last_wheel_ = reading.time;
  if (reading.speed_mps != 0)
    wheels_stopped_since_.reset();
  else if (!wheels_stopped_since_)
    wheels_stopped_since_ = reading.time + -reading.dt_s;
}

ImuReading StandstillDetector::mean() const {
  const auto count = static_cast<double>(readings_.size());
  return {readings_.back().time, force_ / count, rate_ / count};
}

bool StandstillDetector::quiet() const {
  if (!full()) return false;
  const auto count = static_cast<double>(readings_.size());
  const auto deviation = [count](const Vector3d& sum, const Vector3d& squares) {
    return std::sqrt(std::max(0.0, (squares / count - (sum / count).cwiseAbs2()).maxCoeff()));
  };
  return deviation(force_, force2_) < force_limit_ && deviation(rate_, rate2_) < rate_limit_;
}

bool StandstillDetector::is_stationary(std::optional<double> speed_mps) const {
  constexpr double kWheels_s = 0.5, kSlow_mps = 0.5;
  if (has_wheels_)
    return wheels_stopped_since_ && *last_wheel_ - *wheels_stopped_since_ > kWheels_s - 1e-6 && quiet();
  return speed_mps && *speed_mps < kSlow_mps && quiet();
}

namespace {

using Eigen::AngleAxisd;

/// Standard deviation of road slopes, if no rest has given the vertical.
constexpr double kSlope_rad = 0.05;
/// Minimum standard deviation of a vehicle's heading from its course.
constexpr double kCourse_rad = 0.03;
/// Courses with this deviation or less determine a heading.
constexpr double kGoodCourse_rad = 0.15;
/// Faster rotating vehicles do not start the estimate.
constexpr double kStraight_radps = 0.1;

/// Factor on the deviation of the first fix: at the kerb, vehicles mostly get constant reflections.
constexpr double kFirstFix = 3;

double squared(double value) {
  return value * value;
}

}  // namespace

void InitialAttitude::set_stationary(const ImuReading& mean) {
  at_rest_ = mean;
}

std::optional<InertialEstimate> InitialAttitude::begin(const Fix& fix, const ImuReading& mean,
                                                       const DeadReckoningOptions& options) const {
  if (!fix.measured() || !fix.velocity_enu_mps || !fix.velocity_covariance_enu) return std::nullopt;
  const Vector3d& velocity = *fix.velocity_enu_mps;
  const double speed = velocity.head<2>().norm();
  if (speed < options.alignment_speed_mps) return std::nullopt;
  const double rotation_rate =
      mean.angular_rate_radps.z() - (at_rest_ ? at_rest_->angular_rate_radps.z() : 0);
  if (std::abs(rotation_rate) > kStraight_radps) return std::nullopt;
  const Vector3d across = Vector3d(-velocity.y(), velocity.x(), 0) / speed;
  const double course_sigma = std::sqrt(across.dot(*fix.velocity_covariance_enu * across)) / speed;
  if (course_sigma > kGoodCourse_rad) return std::nullopt;

  InertialEstimate started;
  double pitch = 0, roll = 0;
  const TriadModel& accelerometer = mounting_.accelerometer;
  const TriadModel& gyroscope = mounting_.gyroscope;
  const double gravity = 9.8;
  double tilt_sigma = std::hypot(kSlope_rad, accelerometer.bias / gravity);
  double gyroscope_sigma = gyroscope.bias + 1e-5;
  if (at_rest_) {
    const Vector3d& f = at_rest_->specific_force_mps2;
    pitch = std::asin(std::clamp(f.x() / f.norm(), -1.0, 1.0));
    roll = std::atan2(f.y(), f.z());
    started.sensors.gyroscope_bias = at_rest_->angular_rate_radps;
    // Includes Earth's rotation, as the heading was unknown.
    gyroscope_sigma = geodesy::kEarthRotationRate + gyroscope.drift + gyroscope.white;
    // The rest may have been long ago, on another slope.
    tilt_sigma = std::hypot(0.5 * kSlope_rad, accelerometer.bias / gravity);
  }
  const double yaw = std::atan2(velocity.y(), velocity.x());
  const Matrix3d enu_from_body = (AngleAxisd(yaw, Vector3d::UnitZ()) * AngleAxisd(-pitch, Vector3d::UnitY()) *
                                  AngleAxisd(roll, Vector3d::UnitX()))
                                     .toRotationMatrix();
  const Matrix3d ecef_from_enu = geodesy::enu_from_ecef_rotation(fix.position).transpose();
  InertialState& state = started.state;
  state.ecef_from_body = Eigen::Quaterniond(Matrix3d(ecef_from_enu * enu_from_body));
  state.velocity_mps = ecef_from_enu * velocity;
  state.position_m = fix.position_ecef - state.rotation() * mounting_.antenna_m;

  ErrorMatrix& p = started.p;
  const double heading_sigma = std::hypot(kCourse_rad, course_sigma);
  const Matrix3d attitude =
      Vector3d(squared(tilt_sigma), squared(tilt_sigma), squared(heading_sigma)).asDiagonal();
  p.block<3, 3>(kAttitudeError, kAttitudeError) = ecef_from_enu * attitude * ecef_from_enu.transpose();
  p.block<3, 3>(kVelocityError, kVelocityError) =
      ecef_from_enu * *fix.velocity_covariance_enu * ecef_from_enu.transpose() + 0.01 * Matrix3d::Identity();
  p.block<3, 3>(kPositionError, kPositionError) =
      squared(kFirstFix) * (ecef_from_enu * fix.covariance_enu * ecef_from_enu.transpose());
  // Gravity acts on a misaligned axis: a bias while the vehicle is level.
  const double accelerometer_sigma =
      std::hypot(accelerometer.bias, gravity * std::hypot(accelerometer.axes_rad, accelerometer.scale)) +
      1e-4;
  for (int i = 0; i < 3; ++i) {
    p(kAccelerometerBias + i, kAccelerometerBias + i) = squared(accelerometer_sigma);
    p(kGyroscopeBias + i, kGyroscopeBias + i) = squared(gyroscope_sigma);
  }
  p(kWheelScale, kWheelScale) = squared(mounting_.wheels ? mounting_.wheels->scale + 1e-4 : 0);
  p(kRotationScale, kRotationScale) = squared(gyroscope.scale + 1e-6);
  return started;
}

}  // namespace canyon::positioning
