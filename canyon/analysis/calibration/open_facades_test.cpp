#include "canyon/analysis/calibration/calibrate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::calibration {
namespace {

TEST(OpenFacades, CitiesAreDrawnWithTheirShareOfCoatedGlass) {
  std::vector<double> sampled;
  const auto draw = [&sampled](const simulation::Scenario& scenario) {
    sampled.push_back(scenario.city.facades.fractions.at("coated_glass"));
    return std::unique_ptr<simulation::Environment>();
  };
  simulation::Scenario mesh_scenario;
  mesh_scenario.city.source = simulation::MeshCity{};
  const std::vector<Facades> facades = open_facades(mesh_scenario, draw);
  ASSERT_EQ(facades.size(), 3U);
  EXPECT_THAT(sampled, testing::IsEmpty()) << "before they are needed";
  for (const Facades& each : facades) {
    (void)each.make();
    EXPECT_NEAR(sampled.back(), each.coated_glass, 1e-12);
  }
  EXPECT_THAT(sampled, testing::ElementsAre(testing::DoubleNear(0, 1e-12), testing::DoubleNear(0.35, 1e-12),
                                            testing::DoubleNear(0.7, 1e-12)));
}

TEST(OpenFacades, NoneWhereTheScenarioStatesThem) {
  simulation::Scenario scenario;
  scenario.city.facades.fractions = {{"brick", 1}};
  EXPECT_TRUE(open_facades(scenario, {}).empty());
}

TEST(OpenFacades, OnlyAFittedShareCounts) {
  Calibration result;
  EXPECT_FALSE(fitted_glass(result));
  result.coated_glass.emplace();
  result.coated_glass->recorded = "0.25";
  EXPECT_FALSE(fitted_glass(result)) << "not identified";
  result.coated_glass->verdict = Estimate::Verdict::Fitted;
  EXPECT_EQ(fitted_glass(result), 0.25);
}

TEST(OpenFacades, SharesAreItemsOfAScenarioInPercent) {
  const std::vector<std::string> items = facade_fractions(0.7);
  EXPECT_THAT(items, testing::Contains("coated_glass=70"));
  double sum = 0;
  for (const std::string& item : items) sum += std::stod(item.substr(item.find('=') + 1));
  EXPECT_NEAR(sum, 100, 3) << "whole percents";
}

}  // namespace
}  // namespace canyon::calibration
