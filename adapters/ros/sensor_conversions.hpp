#pragma once

#include <algorithm>

#include "adapters/ros/conversions.hpp"
#include "canyon/simulation/inertial/imu_options.hpp"
#include "canyon/simulation/sensor_run.hpp"

namespace canyon::ros_messages {

namespace detail {

/// Converts a vector in the sensor's axes to forward, left, up.
template <class To>
void assign_flu(To& to, const Eigen::Vector3d& from, inertial::ImuAxes axes) {
  const Eigen::Vector3d v = inertial::in_axes(from, axes, inertial::ImuAxes::Flu);
  to.x = v.x();
  to.y = v.y();
  to.z = v.z();
}

template <class Covariance>
void spread_variance(Covariance& covariance, double variance) {
  std::fill(covariance.begin(), covariance.end(), 0.0);
  covariance[0] = covariance[4] = covariance[8] = variance;
}

}  // namespace detail

/// sensor_msgs/Imu of a sample that is not lost: rates [rad/s] and specific force [m/s^2] in the sensor's
/// axes, rotated to forward, left, up if the sample has forward, right, down: at rest z is +9.8. Variances
/// are those of the white noise over a sample. The sensor does not estimate its attitude: the orientation is
/// the identity, orientation_covariance[0] is -1 (REP 145). Precondition: sample.sample.
template <class Imu>
[[nodiscard]] Imu imu_message(const Head& head, const simulation::InertialSample& sample,
                              const inertial::ImuOptions& options) {
  Imu message;
  detail::set_header(message.header, head);
  detail::assign_flu(message.angular_velocity, sample.sample->measured.angular_rate_radps, options.axes);
  detail::assign_flu(message.linear_acceleration, sample.sample->measured.specific_force_mps2, options.axes);
  message.orientation.x = message.orientation.y = message.orientation.z = 0;
  message.orientation.w = 1;
  std::fill(message.orientation_covariance.begin(), message.orientation_covariance.end(), 0.0);
  message.orientation_covariance[0] = -1;
  const inertial::ImuNumbers numbers = inertial::imu_numbers(options);
  const auto variance = [&options](double density) { return density * density * options.rate_hz; };
  detail::spread_variance(message.angular_velocity_covariance, variance(numbers.gyroscope.white));
  detail::spread_variance(message.linear_acceleration_covariance, variance(numbers.accelerometer.white));
  return message;
}

/// sensor_msgs/MagneticField [T] in forward, left, up of the sensor, with the variance of its noise.
template <class MagneticField>
[[nodiscard]] MagneticField magnetic_message(const Head& head, const simulation::MagnetometerSample& sample,
                                             const inertial::MagnetometerOptions& options) {
  MagneticField message;
  detail::set_header(message.header, head);
  detail::assign_flu(message.magnetic_field, sample.measured_t, options.axes);
  const double density = inertial::magnetometer_numbers(options).white;
  detail::spread_variance(message.magnetic_field_covariance, density * density * options.rate_hz);
  return message;
}

/// sensor_msgs/FluidPressure [Pa] of the air, with the variance of its noise.
template <class FluidPressure>
[[nodiscard]] FluidPressure pressure_message(const Head& head, const simulation::BarometerSample& sample,
                                             const inertial::BarometerOptions& options) {
  FluidPressure message;
  detail::set_header(message.header, head);
  message.fluid_pressure = sample.pressure.measured_pa;
  const double noise_pa = inertial::barometer_numbers(options).noise_pa;
  message.variance = noise_pa * noise_pa;
  return message;
}

/// geometry_msgs/TwistWithCovarianceStamped of a vehicle from the wheels of an unsteered axle, in the
/// vehicle's axes at the middle of the axle: forward speed the mean of the wheels, yaw rate their difference
/// divided by the track width. The axle does not slide sideways or upwards, within 0.05 and 0.1 m/s
/// (assumed). Variances include scale, slip and ticks. Rates that are not measured are 0 with a variance of
/// 1e6: nodes that rotate vectors into other frames would spread a NaN.
template <class TwistWithCovarianceStamped>
[[nodiscard]] TwistWithCovarianceStamped wheel_message(const Head& head,
                                                       const simulation::WheelsAtWork& wheels,
                                                       const inertial::WheelOptions& options) {
  const simulation::WheelTwist measured = simulation::wheel_twist(wheels, options);
  TwistWithCovarianceStamped message;
  detail::set_header(message.header, head);
  auto& twist = message.twist.twist;
  twist.linear.x = measured.forward_mps;
  twist.linear.y = twist.linear.z = 0;
  twist.angular.x = twist.angular.y = 0;
  twist.angular.z = measured.yaw_rate_radps;
  std::copy(measured.covariance.begin(), measured.covariance.end(), message.twist.covariance.begin());
  return message;
}

}  // namespace canyon::ros_messages
