#include "adapters/ros2/scenario_run.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "adapters/ros2/rtcm_topic.hpp"
#include "adapters/ros2/testing/rtcm_base.hpp"
#include "canyon/simulation/load_city.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters::ros2 {
namespace {

using positioning::FixKind;
using testing::IsEmpty;

constexpr const char* kDrive = R"(
city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}
sky: {nominal: true}
start: 2026-06-01T08:00:00Z
rate_hz: 1
duration_s: 30
trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 0, north_m: 300, up_m: 2}], speed_mps: 5}
receivers: [{name: car, profile: ublox-f9p, rtk: true}]
)";

class Corrected : public testing::Test {
 protected:
  Corrected() {
    std::ofstream(file_) << kDrive;
    settings_ = read_settings({{"scenario", file_}, {"corrections.from", "topic:rtcm"}});
    scene_ = std::make_shared<simulation::CityScene>(simulation::load_city(settings_.live));
    simulation_ = std::make_shared<simulation::Simulation>(simulated_world(settings_), scene_);
  }

  live::HostSetup setup() {
    live::HostSetup setup;
    setup.options = settings_;
    setup.frame.enu = scene_->city.frame;
    setup.start = simulation_->begin();
    setup.say = [this](live::HostOutputs::Tone, const std::string& line) { said_.push_back(line); };
    setup.city = scene_;
    return setup;
  }

  std::vector<std::string> said_;
  canyon::test::TemporaryFolder folder_;
  std::string file_ = (folder_.path() / "drive.yaml").string();
  NodeSettings settings_;
  std::shared_ptr<simulation::CityScene> scene_;
  std::shared_ptr<const simulation::Simulation> simulation_;
};

struct Collector final : simulation::EpochSink {
  void write(const simulation::Epoch& epoch) override { epochs.push_back(epoch); }
  void finish() override {}
  std::vector<simulation::Epoch> epochs;
};

// Without corrections it is the simulation's run.
TEST_F(Corrected, IsTheScenariosDrive) {
  Collector expected;
  (void)simulation_->run({&expected});
  ScenarioRun run(simulation_, setup());
  for (const simulation::Epoch& each : expected.epochs) {
    ASSERT_TRUE(run.ready());
    const auto step = run.take();
    ASSERT_TRUE(step);
    EXPECT_EQ(step->epoch.observed.time, each.observed.time);
    EXPECT_LT((step->epoch.truth_ecef - each.truth_ecef).norm(), 1e-6);
    EXPECT_LT((step->epoch.observed.fix.position_ecef - each.observed.fix.position_ecef).norm(), 1e-3);
  }
  EXPECT_TRUE(run.finished());
  EXPECT_FALSE(run.take());
}

TEST_F(Corrected, IsFixedByTheTopic) {
  test::Base base;
  ScenarioRun run(simulation_, setup());
  int fixed = 0, epochs = 0;
  while (!run.finished()) {
    const std::int64_t now_ns = run.next_ns();
    const auto step = run.take();
    ++epochs;
    if (step->epoch.observed.fix.kind() == FixKind::Fixed) {
      ++fixed;
      EXPECT_LT(step->epoch.error_enu_m.head<2>().norm(), 0.05);
    }
    // The base waits for the same clock, so it sends after the rover's epoch.
    const std::string bytes = base.bytes(now_ns);
    for (const std::string_view frame : split_frames(bytes)) run.receive_rtcm(frame, now_ns);
  }
  EXPECT_EQ(epochs, 31);
  EXPECT_GT(fixed, 20);
  EXPECT_THAT(said_, IsEmpty());
}

}  // namespace
}  // namespace canyon::adapters::ros2
