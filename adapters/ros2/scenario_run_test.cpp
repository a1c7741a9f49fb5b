#include "adapters/ros2/scenario_run.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::adapters::ros2 {
namespace {

using Step = simulation::LiveReceiver::Step;

std::shared_ptr<const simulation::Simulation> small_drive(double duration_s,
                                                          const std::string& more_receivers = "") {
  const simulation::Scenario scenario = simulation::parse_scenario(
      "city: {synthetic: {seed: 7}, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}\n"
      "sky: {nominal: true, systems: GPS}\nstart: 2026-06-01T08:00:00Z\nrate_hz: 2\n"
      "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 0, north_m: 150, up_m: 2}], "
      "speed_mps: 1}\n"
      "duration_s: " +
          std::to_string(duration_s) + "\nreceivers: [{name: car, profile: paper}" + more_receivers + "]\n",
      "drive.yaml");
  return std::make_shared<simulation::Simulation>(scenario, simulation::load_city(scenario));
}

std::vector<Step> take_all(ScenarioRun& run) {
  std::vector<Step> steps;
  while (!run.finished()) {
    EXPECT_EQ(run.next_ns(), static_cast<std::int64_t>(steps.size()) * 500'000'000);
    if (auto step = run.take()) {
      steps.push_back(std::move(*step));
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  return steps;
}

struct Collector final : simulation::EpochSink {
  void write(const simulation::Epoch& epoch) override { epochs.push_back(epoch); }
  void finish() override {}
  std::vector<simulation::Epoch> epochs;
};

TEST(ScenarioRun, HandsOverTheBasesEpochs) {
  ScenarioRun run(small_drive(5, ", {name: base, profile: ideal, fixed: {east_m: 0, north_m: 0, up_m: 250}}"),
                  1);
  const auto steps = take_all(run);
  ASSERT_EQ(steps.size(), 11U);
  for (const Step& step : steps) {
    EXPECT_EQ(step.epoch.receiver, 0U);
    ASSERT_NE(step.base, nullptr);
    EXPECT_EQ(step.base->epoch.receiver, 1U);
    EXPECT_EQ(step.base->epoch.observed.time, step.epoch.observed.time);
  }
}

// The numbers are those of Simulation::run(), to the bit; more epochs than are kept ahead.
TEST(ScenarioRun, IsTheSimulationsRun) {
  const auto simulation = small_drive(70);
  Collector expected;
  (void)simulation->run({&expected});
  ASSERT_EQ(expected.epochs.size(), 141U);
  ScenarioRun run(simulation, 2);
  const auto steps = take_all(run);
  ASSERT_EQ(steps.size(), expected.epochs.size());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const auto& a = steps[i].epoch;
    const auto& b = expected.epochs[i];
    EXPECT_EQ(a.observed.time, b.observed.time);
    EXPECT_EQ(a.observed.fix.status, b.observed.fix.status);
    if (b.observed.fix.solved()) {
      EXPECT_EQ(a.observed.fix.position_ecef, b.observed.fix.position_ecef);
    }
    ASSERT_EQ(a.observed.satellites.size(), b.observed.satellites.size());
    for (std::size_t s = 0; s < a.observed.satellites.size(); ++s) {
      EXPECT_EQ(a.observed.satellites[s].excess_m, b.observed.satellites[s].excess_m);
      EXPECT_EQ(a.observed.satellites[s].visibility, b.observed.satellites[s].visibility);
    }
    EXPECT_EQ(steps[i].arrival.views.size(), a.observed.satellites.size());
    EXPECT_EQ(a.arrival, nullptr);
  }
  EXPECT_FALSE(run.take());
  EXPECT_EQ(run.next_ns(), std::int64_t{141} * 500'000'000);
}

TEST(ScenarioRun, EndsAtOnceWhereNobodyTakes) {
  const auto simulation = small_drive(140);
  const auto begin = std::chrono::steady_clock::now();
  {
    ScenarioRun run(simulation, 1);
    while (!run.ready()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(60));
}

TEST(ScenarioRun, FaultsComeOutOfTake) {
  ScenarioRun run(small_drive(10), -1);
  while (!run.ready()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_THROW((void)run.take(), InputError);  // -1 threads
}

}  // namespace
}  // namespace canyon::adapters::ros2
