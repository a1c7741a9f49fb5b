#include "canyon/outputs/view/view_sink.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "canyon/outputs/encoding/sinks.hpp"
#include "canyon/outputs/view/header.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::view {
namespace {

using testing::HasSubstr;

struct Changed {
  std::string seed = "3", start = "12:00:00", systems = "GPS", name = "rover";
};

std::unique_ptr<simulation::Simulation> small(const Changed& c) {
  const simulation::Scenario scenario = simulation::parse_scenario(
      "city: {synthetic: {seed: " + c.seed + "}}\nsky: {nominal: true, systems: [" + c.systems +
          "]}\nstart: 2026-06-01T" + c.start +
          "Z\ntrajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\nduration_s: 2\nreceivers: [{name: " +
          c.name + "}]\n",
      "small.yaml");
  return std::make_unique<simulation::Simulation>(
      scenario, std::make_shared<simulation::CityScene>(simulation::load_city(scenario)));
}

TEST(CheckRun, TellsWhatIsOfAnotherScenario) {
  const test::TemporaryFolder folder;
  const auto run = small({});
  const auto view = make_view(*run, folder.path());
  run->run({view.get()});
  EXPECT_EQ(test::refusal([&] { check_run(folder.path(), *run); }), "");
  const auto refused = [&](const Changed& changed) {
    return test::refusal([&] { check_run(folder.path(), *small(changed)); });
  };
  EXPECT_THAT(refused({.seed = "4"}), HasSubstr("other walls than the scenario's"));
  EXPECT_THAT(refused({.start = "12:00:01"}), HasSubstr("other times"));
  EXPECT_THAT(refused({.systems = "GPS, Galileo"}), HasSubstr("other satellites"));
  EXPECT_THAT(refused({.name = "base"}), HasSubstr("other receivers"));
}

TEST(CheckRun, RefusesAViewWithoutARun) {
  const test::TemporaryFolder folder;
  write_header({}, folder.path());
  EXPECT_THAT(test::refusal([&] { check_run(folder.path(), *small({})); }), HasSubstr("other walls"));
}

}  // namespace
}  // namespace canyon::view
