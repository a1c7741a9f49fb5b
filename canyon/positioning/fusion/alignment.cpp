#include "canyon/positioning/fusion/alignment.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/geodesy/constants.hpp"

namespace canyon::positioning {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Roads are as steep as this, a standard deviation: where no rest told the vertical.
constexpr double kSlope_rad = 0.05;
/// A vehicle's heading from its course, a standard deviation at least.
constexpr double kCourse_rad = 0.03;
/// Courses that are known to this or better tell a heading.
constexpr double kGoodCourse_rad = 0.15;
/// Turning vehicles do not begin.
constexpr double kStraight_radps = 0.1;

/// The first fix counts with its deviation times this: all that vehicles meet at the kerb are reflections
/// that stay.
constexpr double kFirstFix = 3;

double squared(double value) {
  return value * value;
}

}  // namespace

void Alignment::stand(const ImuReading& mean) {
  at_rest_ = mean;
}

std::optional<InertialEstimate> Alignment::begin(const Fix& fix, const ImuReading& mean,
                                                 const DeadReckoningOptions& options) const {
  if (!fix.measured() || !fix.velocity_enu_mps || !fix.velocity_covariance_enu) return std::nullopt;
  const Vector3d& velocity = *fix.velocity_enu_mps;
  const double speed = velocity.head<2>().norm();
  if (speed < options.alignment_speed_mps) return std::nullopt;
  const double turning = mean.angular_rate_radps.z() - (at_rest_ ? at_rest_->angular_rate_radps.z() : 0);
  if (std::abs(turning) > kStraight_radps) return std::nullopt;
  const Vector3d across = Vector3d(-velocity.y(), velocity.x(), 0) / speed;
  const double course_sigma = std::sqrt(across.dot(*fix.velocity_covariance_enu * across)) / speed;
  if (course_sigma > kGoodCourse_rad) return std::nullopt;

  InertialEstimate begun;
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
    begun.sensors.gyroscope_bias = at_rest_->angular_rate_radps;
    // Earth's rotation is in it, as the heading was not known.
    gyroscope_sigma = geodesy::kEarthRotationRate + gyroscope.drift + gyroscope.white;
    // The rest may be long ago, on another slope.
    tilt_sigma = std::hypot(0.5 * kSlope_rad, accelerometer.bias / gravity);
  }
  const double yaw = std::atan2(velocity.y(), velocity.x());
  const Matrix3d enu_from_body = (AngleAxisd(yaw, Vector3d::UnitZ()) * AngleAxisd(-pitch, Vector3d::UnitY()) *
                                  AngleAxisd(roll, Vector3d::UnitX()))
                                     .toRotationMatrix();
  const Matrix3d ecef_from_enu = geodesy::enu_from_ecef_rotation(fix.position).transpose();
  InertialState& state = begun.state;
  state.ecef_from_body = Eigen::Quaterniond(Matrix3d(ecef_from_enu * enu_from_body));
  state.velocity_mps = ecef_from_enu * velocity;
  state.position_m = fix.position_ecef - state.rotation() * mounting_.antenna_m;

  ErrorMatrix& p = begun.p;
  const double heading_sigma = std::hypot(kCourse_rad, course_sigma);
  const Matrix3d attitude =
      Vector3d(squared(tilt_sigma), squared(tilt_sigma), squared(heading_sigma)).asDiagonal();
  p.block<3, 3>(kAttitudeError, kAttitudeError) = ecef_from_enu * attitude * ecef_from_enu.transpose();
  p.block<3, 3>(kVelocityError, kVelocityError) =
      ecef_from_enu * *fix.velocity_covariance_enu * ecef_from_enu.transpose() + 0.01 * Matrix3d::Identity();
  p.block<3, 3>(kPositionError, kPositionError) =
      squared(kFirstFix) * (ecef_from_enu * fix.covariance_enu * ecef_from_enu.transpose());
  // A wrong axis feels gravity: a bias as long as the vehicle is level.
  const double accelerometer_sigma =
      std::hypot(accelerometer.bias, gravity * std::hypot(accelerometer.axes_rad, accelerometer.scale)) +
      1e-4;
  for (int i = 0; i < 3; ++i) {
    p(kAccelerometerBias + i, kAccelerometerBias + i) = squared(accelerometer_sigma);
    p(kGyroscopeBias + i, kGyroscopeBias + i) = squared(gyroscope_sigma);
  }
  p(kWheelScale, kWheelScale) = squared(mounting_.wheels ? mounting_.wheels->scale + 1e-4 : 0);
  p(kTurnScale, kTurnScale) = squared(gyroscope.scale + 1e-6);
  return begun;
}

}  // namespace canyon::positioning
