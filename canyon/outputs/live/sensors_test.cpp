// Sensors of vehicles with external poses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <future>
#include <nlohmann/json.hpp>

#include "canyon/base/mavlink/frames.hpp"
#include "canyon/outputs/live/session.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/sensor_run.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/local_connection.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::live {
namespace {

using positioning::FixKind;
using simulation::Epoch;

/// Stores epochs and sensor samples.
class SensedEpochs final : public simulation::EpochSink {
 public:
  void write(const Epoch& epoch) override {
    epochs.push_back(epoch);
    epochs.back().arrival = nullptr;
    if (epoch.sensors == nullptr) return;
    imu.insert(imu.end(), epoch.sensors->imu.begin(), epoch.sensors->imu.end());
    barometer.insert(barometer.end(), epoch.sensors->barometer.begin(), epoch.sensors->barometer.end());
    wheels.insert(wheels.end(), epoch.sensors->wheels.begin(), epoch.sensors->wheels.end());
  }
  void finish() override {}
  [[nodiscard]] bool uses_sensors() const override { return true; }
  std::vector<Epoch> epochs;
  std::vector<simulation::InertialSample> imu;
  std::vector<simulation::BarometerSample> barometer;
  std::vector<simulation::WheelsAtWork> wheels;
};

/// Rest, 300 m to the east, a bend to the north, with 15 s without satellites.
simulation::Scenario drive(const std::string& live, const std::string& imu = "profile: automotive") {
  return simulation::parse_scenario(
      "city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17, height_m: 5}}\n"
      "sky: {nominal: true}\nstart: 2026-06-01T06:00:00Z\nrate_hz: 5\nseed: 4\n"
      "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2, hold_s: 10}, {east_m: 300, north_m: 0, "
      "up_m: 2}, {east_m: 300, north_m: 300, up_m: 2}], acceleration_mps2: 2, speed_mps: 10, attitude: car}\n"
      "receivers: [{name: car, profile: ublox-f9r}]\n"
      "sensors: {imu: {" +
          imu +
          "}, wheels: {}, barometer: {profile: ideal}}\n"
          "faults: [{from_s: 45, until_s: 60, outage: {satellites: [GPS, GLONASS, Galileo, BeiDou]}}]\n" +
          live,
      "s.yaml", {false});
}

std::shared_ptr<simulation::CityScene> scene_of(const simulation::Scenario& scenario) {
  return std::make_shared<simulation::CityScene>(simulation::load_city(scenario));
}

/// The poses of the drive at 50 Hz as a log, and the result of simulate.
class LiveSensors : public ::testing::Test {
 protected:
  LiveSensors() {
    const simulation::Scenario scenario = drive("");
    const simulation::Simulation simulation(scenario, scene_of(scenario));
    (void)simulation.run({&offline_});
    std::ofstream file(log());
    const geodesy::LocalFrame& frame = simulation.environment().city().frame;
    constexpr double kInterval_s = 0.02;
    for (int k = 0; k * kInterval_s < 75; ++k) {
      const simulation::Pose pose = simulation.vehicle_pose(simulation.begin() + k * kInterval_s);
      const Eigen::Vector3d at = frame.local_from_geodetic(pose.position);
      file << nlohmann::json{{"time_s", k * kInterval_s},
                             {"position_m", {at.x(), at.y(), at.z()}},
                             {"yaw_deg", pose.yaw_rad * 180 / M_PI}}
                  .dump()
           << "\n";
    }
  }
  [[nodiscard]] std::string log() const { return (folder_ / "log.jsonl").string(); }
  [[nodiscard]] std::string poses() const {
    return "live: {clock: stamps, poses: [{from: 'file:" + log() + "'}]}\n";
  }

  test::TemporaryFolder folder_;
  SensedEpochs offline_;
};

TEST_F(LiveSensors, FeelThePosesOfALog) {
  const simulation::Scenario scenario = drive(poses());
  SensedEpochs live;
  Session session(scenario, scene_of(scenario));
  (void)session.run({&live}, {});
  ASSERT_GT(live.epochs.size(), 370U);
  // The same sensors, with the same errors, on a path that is 0.8 mm inside the bend.
  ASSERT_GE(live.imu.size(), 7400U);
  double worst_mps2 = 0, worst_radps = 0;
  for (std::size_t k = 0; k < 7400; ++k) {
    ASSERT_EQ(live.imu[k].time, offline_.imu[k].time);
    const inertial::ImuInput &a = live.imu[k].mean, &b = offline_.imu[k].mean;
    worst_mps2 = std::max(worst_mps2, (a.specific_force_mps2 - b.specific_force_mps2).norm());
    worst_radps = std::max(worst_radps, (a.angular_rate_radps - b.angular_rate_radps).norm());
    EXPECT_LT((live.imu[k].truth.sensor.position_m - offline_.imu[k].truth.sensor.position_m).norm(), 3e-3);
  }
  EXPECT_LT(worst_mps2, 0.1);
  EXPECT_LT(worst_radps, 0.02);
  for (std::size_t k = 0; k < 700; ++k) {
    EXPECT_NEAR(live.wheels[k].true_mps[0], offline_.wheels[k].true_mps[0], 0.01);
    EXPECT_NEAR(live.barometer[k].pressure.measured_pa, offline_.barometer[k].pressure.measured_pa, 0.05);
  }
}

TEST_F(LiveSensors, CoastThroughAnOutage) {
  const simulation::Scenario scenario = drive(poses());
  SensedEpochs live;
  Session session(scenario, scene_of(scenario));
  (void)session.run({&live}, {});
  std::size_t coasting = 0, combined = 0;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < live.epochs.size(); ++i) {
    const positioning::Fix& fix = live.epochs[i].observed.fix;
    const double t_s = 0.2 * static_cast<double>(i);
    ASSERT_EQ(fix.kind(), offline_.epochs[i].observed.fix.kind()) << t_s;
    if (t_s > 44 && t_s < 44.9) before = live.epochs[i].error_enu_m;
    if (fix.kind() == FixKind::Combined) ++combined;
    if (fix.kind() != FixKind::DeadReckoning) continue;
    ++coasting;
    EXPECT_LT((live.epochs[i].error_enu_m - before).head<2>().norm(), 1.5) << t_s;
  }
  EXPECT_GT(coasting, 70U);
  EXPECT_GT(combined, 180U);
}

// Each sample once, in order, and none of a pause.
TEST_F(LiveSensors, BeginAnewBehindAPause) {
  {
    std::ifstream all(log());
    std::ofstream some(folder_ / "pause.jsonl");
    int k = 0;
    for (std::string line; std::getline(all, line); ++k)
      if (k < 1000 || k >= 1200) some << line << "\n";  // 20 to 24 s
  }
  const simulation::Scenario scenario =
      drive("live: {clock: stamps, poses: [{from: 'file:" + (folder_ / "pause.jsonl").string() + "'}]}\n");
  SensedEpochs live;
  Session session(scenario, scene_of(scenario));
  (void)session.run({&live}, {});
  std::size_t in_pause = 0;
  for (std::size_t k = 1; k < live.imu.size(); ++k) {
    EXPECT_LT(live.imu[k - 1].time, live.imu[k].time);
    const double t_s = live.imu[k].time - session.start();
    if (t_s > 20.6 && t_s < 24) ++in_pause;
    // No spike of acceleration when the poses continue.
    EXPECT_LT(live.imu[k].mean.specific_force_mps2.norm(), 30) << t_s;
  }
  EXPECT_EQ(in_pause, 0U);
  EXPECT_GT(live.imu.size(), 7000U);
}

// HIGHRES_IMU of all samples: read by the parser of poses, which uses the published layouts.
TEST_F(LiveSensors, GoOutAsHighresImu) {
  const std::string file = (folder_ / "imu.mavlink").string();
  simulation::Scenario scenario =
      drive("live: {clock: stamps, poses: [{from: 'file:" + log() +
                "'}], streams: [{format: highres_imu, to: 'file:" + file + "'}]}\n",
            "profile: ideal, axes: flu");
  SensedEpochs live;
  {
    Session session(scenario, scene_of(scenario));
    (void)session.run({&live}, {});
  }
  std::vector<mavlink::HighresImu> messages;
  mavlink::MavlinkParser parser;
  parser.receive(test::read_bytes(file), [&](const mavlink::Frame& frame) {
    if (const auto* const imu = std::get_if<mavlink::HighresImu>(&frame.message)) messages.push_back(*imu);
  });
  ASSERT_EQ(messages.size(), live.imu.size());
  const mavlink::HighresImu& rest = messages[400];
  EXPECT_NEAR(rest.acceleration_frd_mps2.z(), -9.788, 0.005);
  EXPECT_NEAR(messages[401].time_us - rest.time_us, 10'000, 1);
  std::size_t pressures = 0;
  for (std::size_t k = 0; k < messages.size(); ++k) {
    EXPECT_NEAR(messages[k].acceleration_frd_mps2.x(), live.imu[k].sample->measured.specific_force_mps2.x(),
                1e-5);
    EXPECT_NEAR(messages[k].rates_frd_radps.z(), -live.imu[k].sample->measured.angular_rate_radps.z(), 1e-6);
    pressures += (messages[k].updated & mavlink::HighresImu::kPressure) != 0 ? 1 : 0;
  }
  EXPECT_EQ(pressures, live.barometer.size());
  EXPECT_NEAR(messages.back().pressure_pa, live.barometer.back().pressure.measured_pa, 0.01);
}

// In real time samples are sent when they end, not all at their epoch; the epoch's receiver uses them too.
TEST(LiveSensorOptions, SamplesComeBetweenEpochs) {
  const int port = test::free_port();
  simulation::Scenario scenario =
      drive(fmt::format("live: {{streams: [{{format: highres_imu, to: 'tcp://127.0.0.1:{}'}}]}}\n", port),
            "profile: ideal, axes: flu");
  scenario.duration_s = 2;
  SensedEpochs live;
  Session session(scenario, scene_of(scenario));
  test::LocalConnection client(port);
  std::size_t messages = 0, pieces = 0;
  auto reader = std::async(std::launch::async, [&] {
    mavlink::MavlinkParser parser;
    for (std::string bytes = client.read_some(); !bytes.empty(); bytes = client.read_some()) {
      ++pieces;
      parser.receive(bytes, [&](const mavlink::Frame& frame) {
        messages += std::holds_alternative<mavlink::HighresImu>(frame.message) ? 1 : 0;
      });
    }
  });
  (void)session.run({&live}, {});
  reader.get();
  EXPECT_EQ(messages, live.imu.size()) << "each once";
  EXPECT_GE(live.imu.size(), 190U);
  EXPECT_GT(pieces, 50U) << "not in the ten bursts of the epochs";
  for (std::size_t k = 1; k < live.imu.size(); ++k)
    EXPECT_NEAR(live.imu[k].time - live.imu[k - 1].time, 0.01, 1e-9);
}

TEST(LiveSensorOptions, HighresImuNeedsSensors) {
  const simulation::Scenario scenario = simulation::parse_scenario(
      "city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17, height_m: 5}}\n"
      "sky: {nominal: true}\nstart: 2026-06-01T06:00:00Z\nduration_s: 5\n"
      "trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\n"
      "live: {streams: [{format: highres_imu, to: 'udp://127.0.0.1:14999'}]}\n",
      "s.yaml", {false});
  EXPECT_THAT(canyon::test::refusal([&] { const Session session(scenario, scene_of(scenario)); }),
              ::testing::HasSubstr("no sensor samples to send"));
}

}  // namespace
}  // namespace canyon::live
