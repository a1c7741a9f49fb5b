#include "canyon/receiver/positioning/fusion/inertial_errors.hpp"

#include <algorithm>

#include "canyon/base/geodesy/constants.hpp"

namespace canyon::positioning {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Errors of axes and scales act for the duration of a manoeuvre: white noise of this correlation time [s].
constexpr double kManoeuvre_s = 2;
/// A bias with 1/f noise changes by about its lowest Allan deviation over this time [s].
constexpr double kBiasTime_s = 100;

/// The time derivative of the errors: F of dx/dt = F x.
ErrorMatrix dynamics(const InertialState& state, const ImuReading& motion, const Vector3d& gravity_mps2) {
  const Matrix3d c = state.rotation();
  const Matrix3d earth = skew({0, 0, geodesy::kEarthRotationRate});
  const Vector3d up = state.position_m.normalized();
  ErrorMatrix f = ErrorMatrix::Zero();
  f.block<3, 3>(kAttitudeError, kAttitudeError) = -earth;
  f.block<3, 3>(kAttitudeError, kGyroscopeBias) = -c;
  f.block<3, 1>(kAttitudeError, kRotationScale) = -c.col(2) * motion.angular_rate_radps.z();
  f.block<3, 3>(kVelocityError, kAttitudeError) = -skew(c * motion.specific_force_mps2);
  f.block<3, 3>(kVelocityError, kVelocityError) = -2 * earth;
  // Gravity decreases with the square of the distance from the Earth's centre (Groves 14.31).
  f.block<3, 3>(kVelocityError, kPositionError) =
      2 * gravity_mps2.norm() / state.position_m.norm() * up * up.transpose();
  f.block<3, 3>(kVelocityError, kAccelerometerBias) = -c;
  f.block<3, 3>(kPositionError, kVelocityError) = Matrix3d::Identity();
  return f;
}

/// Spectral density of a triad's noise at the measured `value`.
double density(const TriadModel& triad, double value) {
  const double wrong = std::hypot(triad.scale, triad.axes_rad) * value;
  return triad.white * triad.white + 2 * kManoeuvre_s * wrong * wrong;
}
double bias_density(const TriadModel& triad) {
  return triad.walk * triad.walk + 2 * triad.drift * triad.drift / kBiasTime_s;
}

}  // namespace

ImuReading SensorErrors::corrected(const ImuReading& reading) const {
  ImuReading motion = reading;
  motion.specific_force_mps2 -= accelerometer_bias;
  motion.angular_rate_radps -= gyroscope_bias;
  motion.angular_rate_radps.z() /= 1 + rotation_scale;
  return motion;
}

void InertialEstimate::predict(const ImuReading& motion, double dt_s, const Vector3d& gravity_mps2,
                               const SensorMounting& sensors_of) {
  const ErrorMatrix step = ErrorMatrix::Identity() + dt_s * dynamics(state, motion, gravity_mps2);
  p = (step * p * step.transpose()).eval();
  const double rotation_rate = motion.angular_rate_radps.norm();
  const double pushing = motion.specific_force_mps2.head<2>().norm();
  const auto add = [&](int first, int count, double density_of) {
    for (int i = first; i < first + count; ++i) p(i, i) += density_of * dt_s;
  };
  add(kAttitudeError, 3, density(sensors_of.gyroscope, rotation_rate));
  add(kVelocityError, 3, density(sensors_of.accelerometer, pushing));
  add(kAccelerometerBias, 3, bias_density(sensors_of.accelerometer));
  add(kGyroscopeBias, 3, bias_density(sensors_of.gyroscope));
  symmetrize();
}

void InertialEstimate::symmetrize() {
  for (int j = 0; j < kInertialErrors; ++j) {
    for (int i = 0; i < j; ++i) p(i, j) = p(j, i) = (p(i, j) + p(j, i)) / 2;
    p(j, j) = std::max(p(j, j), 1e-24);
  }
}

void InertialEstimate::correct(const ErrorVector& error) {
  state.ecef_from_body = (rotation_of(error.segment<3>(kAttitudeError)) * state.ecef_from_body).normalized();
  state.velocity_mps += error.segment<3>(kVelocityError);
  state.position_m += error.segment<3>(kPositionError);
  sensors.accelerometer_bias += error.segment<3>(kAccelerometerBias);
  sensors.gyroscope_bias += error.segment<3>(kGyroscopeBias);
  sensors.wheel_scale += error(kWheelScale);
  sensors.rotation_scale += error(kRotationScale);
}

using Eigen::Quaterniond;
using Eigen::Vector3d;

Quaterniond rotation_of(const Vector3d& rotation) {
  const double angle = rotation.norm();
  if (angle == 0) return Quaterniond::Identity();
  return Quaterniond(Eigen::AngleAxisd(angle, rotation / angle));
}

Eigen::Matrix3d skew(const Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

void carry(InertialState& state, const ImuReading& motion, double dt_s, const Vector3d& gravity_mps2) {
  const Vector3d earth(0, 0, geodesy::kEarthRotationRate);
  const Vector3d rotation = motion.angular_rate_radps * dt_s, push = motion.specific_force_mps2 * dt_s;
  // The force rotates with the body, and the axes with the Earth.
  const Vector3d pushed = state.ecef_from_body * (push + 0.5 * rotation.cross(push));
  const Vector3d pushed_on_earth = pushed - 0.5 * dt_s * earth.cross(pushed);
  // Coriolis at the middle of the interval.
  const Vector3d middle = state.velocity_mps + 0.5 * (pushed + gravity_mps2 * dt_s);
  const Vector3d before = state.velocity_mps;
  state.velocity_mps += pushed_on_earth + (gravity_mps2 - 2 * earth.cross(middle)) * dt_s;
  state.position_m += 0.5 * dt_s * (before + state.velocity_mps);
  state.ecef_from_body =
      (rotation_of(-dt_s * earth) * state.ecef_from_body * rotation_of(rotation)).normalized();
  state.time = state.time + dt_s;
}

}  // namespace canyon::positioning
