// Contents of the messages of drive.mcap; tests/cross_checks/mcap.js reads the file itself with another
// library.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>

#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/simulation/sensor_run.hpp"
#include "tests/support/sample_epochs.hpp"

namespace canyon::encoding::mcap_test {
namespace {

/// A file of one epoch with a sample of each wheel: 9.7 and 10.3 m/s.
std::string file_of(const ReceiverDescription& receiver) {
  simulation::SensorBatch batch;
  batch.wheels.emplace_back();
  batch.wheels[0].time = test::sample_time();
  batch.wheels[0].dt_s = 0.02;
  batch.wheels[0].sample.speed_mps = {9.7, 10.3};
  batch.imu.emplace_back();
  batch.imu[0].sample.emplace();
  simulation::Epoch epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {1, 2, 3});
  epoch.sensors = &batch;
  const std::unique_ptr<Encoder> encoder = format_named("mcap").make(receiver);
  std::string bytes = encoder->begin();
  bytes += encoder->encode(epoch);
  return bytes + encoder->end();
}

/// A nav_msgs/Odometry in CDR layout: numbers aligned to their size after the four bytes of its header.
struct Odometry {
  std::array<double, 7> pose{};
  std::array<double, 36> pose_covariance{};
  std::array<double, 6> twist{};
  std::array<double, 36> twist_covariance{};
};
Odometry odometry(const std::string& file, const std::string& frame, const std::string& child) {
  constexpr std::size_t kStampAndLength = 12;
  const std::size_t name = file.find(frame + '\0' + std::string((4 - (frame.size() + 1) % 4) % 4, '\0') +
                                     std::string{static_cast<char>(child.size() + 1), 0, 0, 0} + child);
  EXPECT_NE(name, std::string::npos);
  const auto aligned = [](std::size_t at, std::size_t size) { return (at + size - 1) / size * size; };
  const std::size_t origin = name - kStampAndLength;
  const std::size_t end = aligned(kStampAndLength + frame.size() + 1, 4) + 4 + child.size() + 1;
  Odometry message;
  std::memcpy(&message, file.data() + origin + aligned(end, 8), sizeof message);
  return message;
}

ReceiverDescription on_wheels() {
  ReceiverDescription car{"car"};
  car.sensors.wheels.emplace();
  car.sensors.wheels->track_m = 1.5;
  car.sensors.wheels->tick_m = 0.02;
  car.sensors.wheels->scale = 0.03;
  car.sensors.wheels->slip = 0.04;
  return car;
}

// A tick of 0.02 m in 0.02 s is 1 m/s: the difference of two uniform errors, 2 / 12; scale and slip are 5 %.
TEST(Mcap, WheelsSayWhatTheyKnow) {
  const Odometry m = odometry(file_of(on_wheels()), "odom", "base_link");
  EXPECT_DOUBLE_EQ(m.twist[0], 10);
  EXPECT_NEAR(m.twist[5], 0.4, 1e-12) << "to the left, over 1.5 m";
  const double left = std::pow(0.05 * 9.7, 2) + 1 / 6.0, right = std::pow(0.05 * 10.3, 2) + 1 / 6.0;
  EXPECT_NEAR(m.twist_covariance[0], (left + right) / 4, 1e-12);
  EXPECT_NEAR(m.twist_covariance[35], (left + right) / (1.5 * 1.5), 1e-12);
  EXPECT_NEAR(m.twist_covariance[5], (right - left) / 3, 1e-12);
  EXPECT_EQ(m.twist_covariance[21], 1e6) << "roll is not measured";
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(m.pose_covariance.at(7 * i), 1e6) << "neither is the pose";

  ReceiverDescription one = on_wheels();
  one.sensors.wheels->track_m = 0;
  const Odometry unknown = odometry(file_of(one), "odom", "base_link");
  EXPECT_EQ(unknown.twist[5], 0);
  EXPECT_EQ(unknown.twist_covariance[35], 1e6);
}

TEST(Mcap, AFixHasNoAttitude) {
  const Odometry m = odometry(file_of(on_wheels()), "map", "gnss_enu");
  EXPECT_LT(m.pose_covariance[0], 1e6);
  for (const std::size_t i : {21U, 28U, 35U}) {
    EXPECT_EQ(m.pose_covariance.at(i), 1e6);
    EXPECT_EQ(m.twist_covariance.at(i), 1e6);
  }
}

// A base next to the road: the same epochs, without the vehicle's sensors.
TEST(Mcap, OnlyTheVehicleHasSensors) {
  EXPECT_NE(file_of(on_wheels()).find("/wheels/odometry"), std::string::npos);
  const std::string base = file_of({"base"});
  EXPECT_NE(base.find("/truth"), std::string::npos);
  for (const char* topic : {"/wheels/odometry", "/imu/data_raw"})
    EXPECT_EQ(base.find(topic), std::string::npos) << topic;
}

}  // namespace
}  // namespace canyon::encoding::mcap_test
