#include "canyon/analysis/validation/ensemble.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/base/json.hpp"

namespace canyon::validation {
namespace {

using ::testing::HasSubstr;

KeyMetric headline_of(const char* key, std::optional<double> measured, std::optional<double> simulated) {
  return {
      {key, key, 1, MetricInfo::Kind::Pair, nullptr, metric_info(key)->range}, measured, simulated, {}, {}};
}

/// Simulated satellites used are 1, 2, ... 19.
EnsembleRow row_with(double recorded, double point) {
  EnsembleRow row;
  row.name = "one";
  row.unknowns = {"level: -10 to 6 dB, uniform"};
  row.point = {headline_of("satellites_used", recorded, point), headline_of("horizontal_p50_m", {}, 3.0)};
  for (int k = 1; k <= 19; ++k) {
    row.samples.push_back(
        {{{"level", -k}},
         {headline_of("satellites_used", recorded, k), headline_of("horizontal_p50_m", {}, k)}});
  }
  return row;
}

// The 90 % interval of the next sample after 19 runs, the first to the last: ranks 0.05 x 20, 0.95 x 20.
TEST(Ensemble, IntervalsAreThoseOfTheNextDraw) {
  const auto metrics = ensemble_metrics(row_with(18, 12));
  ASSERT_EQ(metrics.size(), 1U) << "a figure that is not recorded is left out";
  const EnsembleMetric& f = metrics.front();
  EXPECT_EQ(f.median, 10);
  EXPECT_EQ(f.half.low, 5);
  EXPECT_EQ(f.half.high, 15);
  EXPECT_EQ(f.maximum.low, 1);
  EXPECT_EQ(f.maximum.high, 19);
  EXPECT_FALSE(f.within_half());
  EXPECT_TRUE(f.within_most());
  EXPECT_EQ(f.point, 12);
}

// By hand, in units of one satellite: distance 8 / 2, half interval 10 / 4, 3 above it, 18 / 20 of the most.
TEST(Ensemble, ScoresByHand) {
  const EnsembleMetric f = ensemble_metrics(row_with(18, 12)).front();
  EXPECT_NEAR(f.score.value(), (8.0 / 2 + 10.0 / 4 + 3 + 18.0 / 20) / 2.5, 1e-12);
  EXPECT_NEAR(f.point_score.value(), 6, 1e-12);
  // Outside both intervals its distances from both count.
  EXPECT_NEAR(ensemble_metrics(row_with(21, 12)).front().score.value(),
              (11.0 / 2 + 10.0 / 4 + 6 + 18.0 / 20 + 2) / 2.5, 1e-12);
}

TEST(Ensemble, CountsOverRecordings) {
  const std::vector<EnsembleRow> rows{row_with(18, 12), row_with(12, 12), row_with(21, 12)};
  const Coverage sum = coverage(rows);
  EXPECT_EQ(sum.metrics, 3U);
  EXPECT_EQ(sum.within_half, 1U);
  EXPECT_EQ(sum.within_most, 2U);
  EXPECT_EQ(sum.point_score, (6.0 + 0 + 9) / 3);
  const std::string text = ensemble_text(rows);
  EXPECT_THAT(text, HasSubstr("- level: -10 to 6 dB, uniform"));
  EXPECT_THAT(text, HasSubstr("within the 90 % interval                     2 (67 %)"));
  const Json json = Json::parse(ensemble_json(rows));
  EXPECT_EQ(json.at("coverage").at("within_90").get<int>(), 2);
  EXPECT_EQ(json.at("recordings")[0].at("draws")[4].at("unknowns").at("level").get<double>(), -5);
}

}  // namespace
}  // namespace canyon::validation
