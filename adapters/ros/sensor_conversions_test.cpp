#include "adapters/ros/sensor_conversions.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <array>

#include "adapters/ros/testing/stand_ins.hpp"

#ifdef CANYON_WITH_ROS2
#include <geometry_msgs/msg/twist_with_covariance_stamped.hpp>
#include <sensor_msgs/msg/fluid_pressure.hpp>
#include <sensor_msgs/msg/imu.hpp>
#include <sensor_msgs/msg/magnetic_field.hpp>
#endif

namespace canyon::ros_messages {
namespace {

#ifdef CANYON_WITH_ROS2
using Imu = sensor_msgs::msg::Imu;
using MagneticField = sensor_msgs::msg::MagneticField;
using FluidPressure = sensor_msgs::msg::FluidPressure;
using Twist = geometry_msgs::msg::TwistWithCovarianceStamped;
#else
using test::messages::Header;
using test::messages::Vector3;
struct Imu {
  Header header;
  test::messages::Quaternion orientation;
  Vector3 angular_velocity, linear_acceleration;
  std::array<double, 9> orientation_covariance{}, angular_velocity_covariance{},
      linear_acceleration_covariance{};
};
struct MagneticField {
  Header header;
  Vector3 magnetic_field;
  std::array<double, 9> magnetic_field_covariance{};
};
struct FluidPressure {
  Header header;
  double fluid_pressure = 7, variance = 7;
};
struct Twist {
  Header header;
  struct {
    struct {
      Vector3 linear, angular;
    } twist;
    std::array<double, 36> covariance{};
  } twist;
};
#endif

simulation::InertialSample sample() {
  simulation::InertialSample sample;
  sample.sample = inertial::ImuSample{1.5, {{0.5, -1.25, 9.75}, {0.01, 0.02, -0.03}}};
  return sample;
}

TEST(SensorConversions, ImuIsForwardLeftUp) {
  inertial::ImuOptions options;
  const auto flu = imu_message<Imu>({{3, 4}, "imu"}, sample(), options);
  EXPECT_EQ(flu.header.stamp.sec, 3);
  EXPECT_EQ(flu.header.frame_id, "imu");
  EXPECT_EQ(flu.linear_acceleration.x, 0.5);
  EXPECT_EQ(flu.linear_acceleration.y, -1.25);
  EXPECT_EQ(flu.linear_acceleration.z, 9.75);
  EXPECT_EQ(flu.angular_velocity.z, -0.03);
  EXPECT_EQ(flu.orientation_covariance[0], -1);
  EXPECT_EQ(flu.orientation.w, 1);
  options.axes = inertial::ImuAxes::Frd;
  const auto frd = imu_message<Imu>({{3, 4}, "imu"}, sample(), options);
  EXPECT_EQ(frd.linear_acceleration.x, 0.5);
  EXPECT_EQ(frd.linear_acceleration.y, 1.25);
  EXPECT_EQ(frd.linear_acceleration.z, -9.75);
  EXPECT_EQ(frd.angular_velocity.y, -0.02);
}

// White noise of a density d over samples of 1 / f has the variance d^2 f: 0.6 deg/sqrt(h) is 1.7453e-4
// rad/s/sqrt(Hz), at 100 Hz (1.7453e-3 rad/s)^2.
TEST(SensorConversions, ImuStatesItsNoise) {
  inertial::ImuOptions options;
  options.rate_hz = 100;
  options.gyroscope.angle_random_walk_deg_sqrt_h = 0.6;
  const auto m = imu_message<Imu>({{3, 4}, "imu"}, sample(), options);
  for (const std::size_t i : {0U, 4U, 8U}) {
    EXPECT_NEAR(std::sqrt(m.angular_velocity_covariance[i]), 1.74533e-3, 1e-8);
  }
  EXPECT_EQ(m.angular_velocity_covariance[1], 0);
  EXPECT_GT(m.linear_acceleration_covariance[0], 0);
}

TEST(SensorConversions, FieldsAreInTeslaForwardLeftUp) {
  inertial::MagnetometerOptions options;
  options.noise_ut = 0.3;
  options.axes = inertial::ImuAxes::Frd;
  simulation::MagnetometerSample sample;
  sample.measured_t = {20e-6, 5e-6, 40e-6};
  const auto m = magnetic_message<MagneticField>({{3, 4}, "magnetometer"}, sample, options);
  EXPECT_EQ(m.header.frame_id, "magnetometer");
  EXPECT_EQ(m.magnetic_field.x, 20e-6);
  EXPECT_EQ(m.magnetic_field.y, -5e-6);
  EXPECT_EQ(m.magnetic_field.z, -40e-6);
  EXPECT_NEAR(std::sqrt(m.magnetic_field_covariance[4]), 0.3e-6, 1e-12);
  EXPECT_EQ(m.magnetic_field_covariance[1], 0);
}

TEST(SensorConversions, PressuresAreInPascal) {
  inertial::BarometerOptions options;
  options.noise_pa = 2;
  simulation::BarometerSample sample;
  sample.pressure.measured_pa = 101200;
  const auto m = pressure_message<FluidPressure>({{3, 4}, "barometer"}, sample, options);
  EXPECT_EQ(m.fluid_pressure, 101200);
  EXPECT_EQ(m.variance, 4);
}

TEST(SensorConversions, WheelsAreASpeedAndATurn) {
  inertial::WheelOptions options;
  options.track_m = 1.5;
  options.tick_m = 0;
  options.scale = 0.03;
  options.slip = 0.04;
  simulation::WheelsAtWork wheels;
  wheels.dt_s = 0.1;
  wheels.sample.speed_mps = {9.7, 10.3};
  const auto m = wheel_message<Twist>({{3, 4}, "base_link"}, wheels, options);
  EXPECT_DOUBLE_EQ(m.twist.twist.linear.x, 10);
  EXPECT_EQ(m.twist.twist.linear.y, 0);
  EXPECT_NEAR(m.twist.twist.angular.z, 0.4, 1e-12);  // to the left
  // Each wheel is off by 5 % (0.485 and 0.515 m/s), their mean by half of the root of the sum of squares.
  EXPECT_NEAR(std::sqrt(m.twist.covariance[0]), std::hypot(0.485, 0.515) / 2, 1e-12);
  EXPECT_NEAR(std::sqrt(m.twist.covariance[35]), std::hypot(0.485, 0.515) / 1.5, 1e-12);
  EXPECT_NEAR(m.twist.covariance[5], (0.515 * 0.515 - 0.485 * 0.485) / 3,
              1e-12);  // the faster wheel has a larger error
  EXPECT_EQ(m.twist.covariance[21], 1e6);
  options.track_m = 0;
  const auto one = wheel_message<Twist>({{3, 4}, "base_link"}, wheels, options);
  EXPECT_EQ(one.twist.twist.angular.z, 0);
  EXPECT_EQ(one.twist.covariance[35], 1e6);
}

}  // namespace
}  // namespace canyon::ros_messages
