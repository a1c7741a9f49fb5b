#include "canyon/validation/map_judgement.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/tracking/noise.hpp"

namespace canyon::validation {
namespace {

using geodesy::GpsTime;
using heatmap::CellState;
using heatmap::Layer;
using ::testing::HasSubstr;

const std::vector<Layer> kLayers{Layer::HorizontalErrorP95, Layer::Availability, Layer::HorizontalErrorP50};

/// Errors of a Rayleigh distribution whose scale differs from place to place, as the map knows: its median is
/// s sqrt(2 ln 2), its 95th percentile s sqrt(2 ln 20).
std::vector<MapEpoch> rayleigh(std::size_t n, double scale_of_map) {
  RandomStream random(3, "map judgement");
  std::vector<MapEpoch> epochs;
  for (std::size_t i = 0; i < n; ++i) {
    const double s = 1 + 9 * random.uniform();
    MapEpoch& e = epochs.emplace_back();
    e.time = GpsTime::from_nanoseconds(static_cast<std::int64_t>(i) * 1'000'000'000);
    e.known = e.solved = true;
    e.error_m = s * std::hypot(random.normal(), random.normal());
    e.p50_m = scale_of_map * s * std::sqrt(2 * std::log(2));
    e.p95_m = scale_of_map * s * std::sqrt(2 * std::log(20));
    e.availability = 0.5;
  }
  return epochs;
}

// A map that knows the distribution covers 50 % and 95 % everywhere; one with half the errors covers
// 1 - exp(-ln 2 / 4) = 15.9 % and 1 - exp(-ln 20 / 4) = 52.7 %. 20,000 epochs: three standard errors are 1.1
// %.
TEST(MapJudgement, CoverageIsThatOfTheDistribution) {
  const MapJudgement good = judge_map(rayleigh(20'000, 1)), half = judge_map(rayleigh(20'000, 0.5));
  ASSERT_EQ(good.strata.size(), 4U);
  for (const MapStratum& s : good.strata) {
    EXPECT_NEAR(s.within_p50.value, 0.5, 0.02) << s.name;
    EXPECT_NEAR(s.within_p95.value, 0.95, 0.01) << s.name;
    EXPECT_LT(s.within_p50.low, 0.5) << s.name;
    EXPECT_GT(s.within_p50.high, 0.5) << s.name;
  }
  EXPECT_NEAR(half.strata[0].within_p50.value, 1 - std::exp(-std::log(2) / 4), 0.011);
  EXPECT_NEAR(half.strata[0].within_p95.value, 1 - std::exp(-std::log(20) / 4), 0.011);
  EXPECT_LT(half.strata[0].within_p50.high, 0.3);
  EXPECT_GT(good.strata[3].recorded_p50_m, 2 * good.strata[1].recorded_p50_m);
  EXPECT_GT(good.correlation->rho, 0.4);
  EXPECT_EQ(good.judged, 20'000U);
  EXPECT_DOUBLE_EQ(good.map_availability, 0.5);
  EXPECT_DOUBLE_EQ(good.recorded_availability, 1);
}

TEST(MapJudgement, CountsWhatItCannotJudge) {
  std::vector<MapEpoch> epochs = rayleigh(10, 1);
  epochs[0].known = false;
  epochs[1].solved = false;
  epochs[2].p95_m = NAN;
  const MapJudgement judgement = judge_map(epochs);
  EXPECT_EQ(judgement.epochs, 10U);
  EXPECT_EQ(judgement.known, 9U);
  EXPECT_EQ(judgement.judged, 7U);
  EXPECT_DOUBLE_EQ(judgement.recorded_availability, 8.0 / 9);
  EXPECT_THAT(to_text(judgement), HasSubstr("10 recorded epochs, 9 of them in computed cells, 7 with a fix"));
  EXPECT_TRUE(judge_map({}).strata.empty());
  EXPECT_NE(to_text(judge_map({})), "");
}

// Places come through the frames of city and map, here with origins 100 m apart; the altitude is the asked
// one.
TEST(MapJudgement, LooksEachEpochUpInTheMap) {
  const geodesy::LocalFrame city(geodesy::Geodetic::from_degrees(22.3, 114.17, 0));
  const geodesy::LocalFrame frame(city.geodetic_from_local({100, 0, 0}));
  Comparison comparison;
  for (int i = 0; i < 3; ++i) {
    ComparedEpoch epoch;
    epoch.time = GpsTime::from_nanoseconds(i);
    epoch.place_enu_m = {30.0 * i, 0, 2};
    epoch.measured.solved = i != 2;
    epoch.measured.error_enu_m = {3, 4, 99};
    comparison.epochs.push_back(epoch);
  }
  std::vector<Eigen::Vector2d> asked;
  const heatmap::MapLookup map = [&](const Eigen::Vector2d& enu, double altitude_m, GpsTime) {
    asked.push_back(enu);
    EXPECT_EQ(altitude_m, 2);
    heatmap::StoredMap::Answer answer;
    answer.values = {9, 0.75, 4};
    if (asked.size() == 2) answer.state = CellState::InsideBuilding;
    return std::optional(answer);
  };
  const std::vector<MapEpoch> epochs = map_epochs(comparison, 0, 3, city, map, frame, kLayers, 2);
  ASSERT_EQ(epochs.size(), 3U);
  EXPECT_NEAR(asked[1].x(), -70, 0.01);
  EXPECT_DOUBLE_EQ(epochs[0].error_m, 5);
  EXPECT_EQ(epochs[0].p50_m, 4);
  EXPECT_EQ(epochs[0].p95_m, 9);
  EXPECT_EQ(epochs[0].availability, 0.75);
  EXPECT_FALSE(epochs[1].known);
  EXPECT_DOUBLE_EQ(epochs[2].way_m, 60);
  EXPECT_TRUE(std::isnan(epochs[2].error_m));
  EXPECT_THROW((void)map_epochs(comparison, 0, 3, city, map, frame, {Layer::Hdop}, 2), InputError);
}

}  // namespace
}  // namespace canyon::validation
