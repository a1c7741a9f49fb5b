// A scenario's own drive in the node: its truth and its receiver.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "adapters/ros2/node_truth.hpp"
#include "adapters/ros2/rtcm_topic.hpp"
#include "adapters/ros2/testing/rtcm_base.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters::ros2 {
namespace {

using positioning::FixKind;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Step = simulation::ReceiverRunner::Step;

const std::string kDrive = R"(
city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}
sky: {nominal: true}
start: 2026-06-01T08:00:00Z
rate_hz: 1
duration_s: 30
trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 0, north_m: 300, up_m: 2}], speed_mps: 5, acceleration_mps2: 2}
)";
const std::string kCar = "receivers: [{name: car, profile: ublox-f9p, rtk: true}]\n";

struct Collector final : simulation::EpochSink {
  void write(const simulation::Epoch& epoch) override { epochs.push_back(epoch); }
  void finish() override {}
  std::vector<simulation::Epoch> epochs;
};

/// Stores the epochs of the receiver and of its base.
class EpochRecorder final : public live::EpochPublisher {
 public:
  EpochRecorder(std::vector<Step>& steps, std::vector<Step>& bases) : steps_(steps), bases_(bases) {}
  void publish(const live::ReceiverReport& report) override {
    if (report.step != nullptr) steps_.push_back(*report.step);
    if (report.base != nullptr) bases_.push_back(*report.base);
  }

 private:
  std::vector<Step>&steps_, &bases_;
};

/// The node's receiver in a drive.
class Drove {
 public:
  explicit Drove(const std::string& drive, const Parameters& more = {}) {
    std::ofstream(file_) << drive;
    Parameters given{{"scenario", file_}};
    for (const auto& [name, value] : more) given[name] = value;
    settings = read_settings(given);
    auto scene = std::make_shared<simulation::CityScene>(simulation::load_city(settings.live));
    simulation = std::make_shared<simulation::Simulation>(simulated_world(settings), scene);
    truth.emplace(settings, scene->city, simulation);
    hosted.emplace(setup_of(
        settings, std::move(scene), {}, "/car",
        [this](live::Severity, const std::string& line) { logged.push_back(line); }, simulation));
    hosted->add(std::make_unique<EpochRecorder>(steps, bases));
  }
  void go_to(std::int64_t now_ns) {
    hosted->follow(now_ns,
                   [this](std::int64_t at_ns, std::string& reason) { return truth->at(at_ns, reason); });
  }
  std::vector<simulation::Epoch> expected() {
    Collector collector;
    (void)simulation->run({&collector});
    return collector.epochs;
  }

  NodeSettings settings;
  Drive simulation;
  std::optional<NodeTruth> truth;
  std::optional<live::HostedReceiver> hosted;
  std::vector<Step> steps, bases;
  std::vector<std::string> logged;

 private:
  canyon::test::TemporaryFolder folder_;
  std::string file_ = (folder_.path() / "drive.yaml").string();
};

void expect_same(const simulation::Epoch& a, const simulation::Epoch& b) {
  EXPECT_EQ(a.observed.time, b.observed.time);
  EXPECT_EQ(a.observed.fix.kind(), b.observed.fix.kind());
  EXPECT_LT((a.truth_ecef - b.truth_ecef).norm(), 1e-6);
  if (b.observed.fix.solved()) {
    EXPECT_LT((a.observed.fix.position_ecef - b.observed.fix.position_ecef).norm(), 1e-3);
  }
  ASSERT_EQ(a.observed.satellites.size(), b.observed.satellites.size());
  for (std::size_t s = 0; s < a.observed.satellites.size(); ++s) {
    EXPECT_EQ(a.observed.satellites[s].visibility, b.observed.satellites[s].visibility);
    EXPECT_NEAR(a.observed.satellites[s].excess_m, b.observed.satellites[s].excess_m, 1e-6);
  }
}

// The numbers are those of Simulation::run(). Epochs are at their own instants, at any time of the call.
TEST(NodeDrive, IsTheSimulationsRun) {
  std::string street = kDrive + kCar;
  street.replace(street.find("open: true"), 10, "synthetic: {seed: 7}");
  for (const char* corrections : {"", "topic:rtcm"}) {
    Drove drive(street, {{"corrections.from", corrections}});
    const auto expected = drive.expected();
    ASSERT_EQ(expected.size(), 31U);
    drive.go_to(2'500'000'000);
    EXPECT_EQ(drive.steps.size(), 3U);
    EXPECT_EQ(drive.hosted->next_ns(), 3'000'000'000);
    drive.go_to(100'000'000'000);
    ASSERT_EQ(drive.steps.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) expect_same(drive.steps[i].epoch, expected[i]);
    EXPECT_TRUE(drive.hosted->over());
    EXPECT_EQ(drive.hosted->next_ns(), 31'000'000'000);
    EXPECT_THAT(drive.logged, IsEmpty());
  }
}

TEST(NodeDrive, ATimeThatGoesBackGivesTheSameNumbers) {
  Drove drive(kDrive + kCar);
  drive.go_to(5'000'000'000);
  drive.hosted->reset();
  drive.go_to(5'000'000'000);
  ASSERT_EQ(drive.steps.size(), 12U);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(drive.steps[i].epoch.observed.fix.position_ecef,
              drive.steps[i + 6].epoch.observed.fix.position_ecef);
  }
}

// A fixed base corrects positions; a base on the vehicle yields its heading.
TEST(NodeDrive, HasItsBase) {
  for (const char* position : {"fixed: {east_m: 0, north_m: 0, up_m: 50}", "lever_arm: {forward_m: 1}"}) {
    Drove drive(kDrive +
                "receivers:\n  - {name: car, profile: ublox-f9p, rtk: true, corrections: {from: base}}\n" +
                "  - {name: base, profile: ublox-f9p, " + position + "}\n");
    const auto expected = drive.expected();
    drive.go_to(30'000'000'000);
    ASSERT_EQ(2 * drive.steps.size(), expected.size());
    for (std::size_t i = 0; i < drive.steps.size(); ++i) {
      expect_same(drive.steps[i].epoch, expected[2 * i]);
      ASSERT_LT(i, drive.bases.size());
      EXPECT_EQ(drive.bases[i].epoch.receiver, 1U);
      expect_same(drive.bases[i].epoch, expected[2 * i + 1]);
    }
    const auto& baseline = drive.steps.back().epoch.observed.fix.baseline;
    ASSERT_TRUE(baseline);
    EXPECT_EQ(baseline->moving_base, std::string(position).starts_with("lever"));
  }
}

TEST(NodeDrive, ABaseThatIsNowhereIsTold) {
  Drove drive(kDrive +
              "receivers:\n  - {name: car, profile: ublox-f9p, rtk: true, corrections: {from: base}}\n" +
              "  - {name: base, profile: ublox-f9p}\n");
  drive.hosted->update(0, [&](std::string&) {
    return live::HostedReceiver::Antennas{drive.simulation->antenna_pose(0, drive.simulation->begin())};
  });
  EXPECT_THAT(drive.logged, ElementsAre(HasSubstr("the base has no position")));
}

// Dead reckoning uses the samples of the vehicle's sensors.
TEST(NodeDrive, FeelsItsSensors) {
  Drove drive(kDrive + "sensors: {imu: {profile: automotive, rate_hz: 100}, wheels: {}}\n" +
              "receivers: [{name: car, profile: ublox-f9r}]\n");
  const auto expected = drive.expected();
  drive.go_to(30'000'000'000);
  ASSERT_EQ(drive.steps.size(), expected.size());
  int fused = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    expect_same(drive.steps[i].epoch, expected[i]);
    fused += expected[i].observed.fix.fused() ? 1 : 0;
  }
  EXPECT_GT(fused, 5);
}

TEST(NodeDrive, IsFixedByTheTopic) {
  test::Base base;
  Drove drive(kDrive + kCar, {{"corrections.from", "topic:rtcm"}});
  for (std::int64_t now_ns = 0; now_ns <= 30'000'000'000; now_ns += 1'000'000'000) {
    drive.go_to(now_ns);
    // The base waits for the same clock, so it sends after the rover's epoch.
    const std::string bytes = base.bytes(now_ns);
    for (const std::string_view frame : split_frames(bytes)) drive.hosted->take_rtcm(frame, now_ns);
  }
  int fixed = 0;
  for (const Step& step : drive.steps) {
    if (step.epoch.observed.fix.kind() != FixKind::Fixed) continue;
    ++fixed;
    EXPECT_LT(step.epoch.error_enu_m.head<2>().norm(), 0.05);
  }
  EXPECT_EQ(drive.steps.size(), 31U);
  EXPECT_GT(fixed, 20);
  EXPECT_THAT(drive.logged, IsEmpty());
}

}  // namespace
}  // namespace canyon::adapters::ros2
