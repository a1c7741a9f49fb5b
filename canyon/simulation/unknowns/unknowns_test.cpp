#include "canyon/simulation/unknowns/unknowns.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "canyon/base/input_error.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::unknowns {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// @param rest of the receiver, and other keys after it
simulation::Scenario scenario_of(const std::string& receiver, const std::string& rest = "",
                                 const std::string& city = "synthetic: {seed: 2}") {
  return simulation::parse_scenario("city: {" + city + R"(}
sky: {nominal: true}
start: 2026-06-01T08:00:00Z
trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}
receivers: [{profile: )" + receiver + "}]\n" +
                                        rest,
                                    "scenario.yaml");
}

TEST(Unknowns, WhatIsSaidNarrowsOrRemovesThem) {
  EXPECT_THAT(priors_of(scenario_of("ublox-m8t")),
              ElementsAre("level: -10 to 6 dB, uniform", "skyline: 0 to 0.75, uniform",
                          HasSubstr("facades: coated glass on 0 to 0.7")));
  EXPECT_THAT(priors_of(scenario_of("ublox-m8t, signal: {installation: roof}", "surroundings: dense\n")),
              ElementsAre("level: normal, 4 dB about the installation's", "skyline: 0.25 to 0.75, uniform",
                          HasSubstr("facades")));
  EXPECT_THAT(priors_of(scenario_of("ublox-m8t", "shadowing: {skyline: {share: 0.3}}\n",
                                    "synthetic: {seed: 2}, facades: {mix: urban_stock}")),
              ElementsAre("level: -10 to 6 dB, uniform"));
  EXPECT_THAT(priors_of(scenario_of("ublox-m8t", "surroundings: open\n"), {Unknown::Level}),
              ElementsAre(HasSubstr("facades")));
  // Without strength of signals there is no level, and in an open field no facade.
  EXPECT_THAT(
      priors_of(scenario_of("paper", "", "open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17}")),
      IsEmpty());
}

TEST(Unknowns, DrawsFillTheirDistributions) {
  constexpr std::size_t kN = 20;
  const simulation::Scenario scenario = scenario_of("ublox-m8t");
  const double level_db = scenario.receivers.front().options.signal.link.above_minimum_db;
  const UnknownSamples samples(7, kN), again(7, kN);
  std::set<int> levels, fractions;
  for (std::size_t k = 0; k < kN; ++k) {
    simulation::Scenario sampled = scenario;
    const auto values = samples.apply(k, sampled);
    const tracking::SignalOptions& signal = sampled.receivers.front().options.signal;
    EXPECT_NEAR(signal.link.above_minimum_db, std::max(-10.0, level_db + values.at("level")), 1e-9);
    EXPECT_EQ(signal.shadowing.skyline.fraction, values.at("skyline"));
    EXPECT_NEAR(sampled.city.facades.fractions.at("coated_glass"), values.at("facades"), 1e-12);
    double sum = 0;
    for (const auto& [name, fraction] : sampled.city.facades.fractions) sum += fraction;
    EXPECT_NEAR(sum, 1, 1e-12);
    levels.insert(static_cast<int>((values.at("level") + 10) / 16 * kN));
    fractions.insert(static_cast<int>(values.at("skyline") / 0.75 * kN));
    simulation::Scenario same = scenario;
    EXPECT_EQ(again.apply(k, same), values);
  }
  EXPECT_EQ(levels.size(), kN) << "each stratum has one draw";
  EXPECT_EQ(fractions.size(), kN);
}

// A standard deviation given by the user is kept, and the run samples from it.
TEST(Unknowns, StatedDeviationsAreUsed) {
  simulation::Scenario scenario =
      scenario_of("ublox-m8t, signal: {installation: roof, installation_sigma_db: 1.5}", "");
  scenario.city.source = simulation::MeshCity{};
  EXPECT_THAT(priors_of(scenario),
              ::testing::Contains(std::string("level: normal, 1.5 dB about the installation's")));
  EXPECT_THAT(priors_of(scenario_of("ublox-m8t, signal: {installation_db: -3.8}")),
              ::testing::Contains(std::string("level: normal, 1 dB about the installation's")));
  (void)UnknownSamples(1, 5).apply(0, scenario);
  EXPECT_EQ(scenario.receivers.front().options.signal.installation_sigma_db, 0);
  EXPECT_EQ(scenario.city.georeference.sigma_m, 3);
  scenario.city.georeference.sigma_m = 0.7;
  (void)UnknownSamples(1, 5).apply(1, scenario);
  EXPECT_EQ(scenario.city.georeference.sigma_m, 0.7);
}

TEST(Unknowns, ForgottenScenariosSayNothing) {
  simulation::Scenario scenario =
      scenario_of("ublox-m8t, signal: {installation: roof, installation_db: 4}", "surroundings: dense\n",
                  "synthetic: {seed: 2}, facades: {mix: urban_stock}");
  forget(scenario);
  EXPECT_EQ(priors_of(scenario), priors_of(scenario_of("ublox-m8t")));
}

TEST(Unknowns, NamesAreChecked) {
  EXPECT_EQ(unknown_of("map"), Unknown::Map);
  EXPECT_EQ(unknowns_of("level, map"), (std::vector{Unknown::Level, Unknown::Map}));
  EXPECT_TRUE(unknowns_of("").empty());
  try {
    (void)unknown_of("mapp");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_EQ(e.problem(), "there is no unknown 'mapp'");
    EXPECT_THAT(e.hint(), HasSubstr("level, skyline, facades, map"));
  }
}

}  // namespace
}  // namespace canyon::unknowns
