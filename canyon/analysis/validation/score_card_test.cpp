#include "canyon/analysis/validation/recording_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace canyon::validation {
namespace {

using ::testing::HasSubstr;

KeyMetric headline(const char* key, std::optional<double> measured, std::optional<double> simulated) {
  return {
      {key, key, 2, MetricInfo::Kind::Pair, nullptr, metric_info(key)->range}, measured, simulated, {}, {}};
}

TEST(ScoreCard, RangesAreThoseOfTheDocs) {
  const auto within = [](const char* key, std::optional<double> measured, std::optional<double> simulated) {
    return headline(key, measured, simulated).within();
  };
  EXPECT_EQ(within("tracked_nlos", 0.5, 0.6), true);
  EXPECT_EQ(within("tracked_nlos", 0.5, 0.39), false);
  EXPECT_EQ(within("cn0_los_less_nlos_db", 12.0, 10.0), true);
  EXPECT_EQ(within("satellites_used", 12.0, 13.1), false);
  EXPECT_EQ(within("horizontal_p50_m", 10.0, 7.0), true);
  EXPECT_EQ(within("horizontal_p95_m", 10.0, 14.1), false);
  EXPECT_EQ(within("ks_error_los", {}, 0.2), true);
  EXPECT_EQ(within("spearman", {}, 0.59), false);
  EXPECT_EQ(within("median_difference_m", {}, 10.1), false);
  EXPECT_EQ(within("cn0_los_dbhz", 40.0, 40.0), std::nullopt) << "has no range";
  EXPECT_EQ(within("tracked_los", {}, 1.0), std::nullopt) << "not recorded";
}

// In units of the ranges, by hand: 0 for a perfect simulation, 1 at the ends.
TEST(ScoreCard, DistancesByHand) {
  const auto distance = [](const char* key, std::optional<double> measured, std::optional<double> simulated) {
    return headline(key, measured, simulated).distance().value();
  };
  EXPECT_NEAR(distance("tracked_nlos", 0.5, 0.45), -0.5, 1e-12);
  EXPECT_NEAR(distance("satellites_used", 12.0, 15.0), 3, 1e-12);
  EXPECT_NEAR(distance("horizontal_p50_m", 10.0, 7.0), -1, 1e-12);
  EXPECT_NEAR(distance("horizontal_p50_m", 10.0, 14.0), 1, 1e-12);
  EXPECT_EQ(distance("horizontal_p95_m", 10.0, 10.0), 0);
  EXPECT_NEAR(distance("ks_error_los", {}, 0.1), 0.5, 1e-12);
  EXPECT_EQ(distance("spearman", {}, 1.0), 0);
  EXPECT_NEAR(distance("spearman", {}, 0.6), 1, 1e-12);
  EXPECT_NEAR(distance("median_difference_m", {}, 25.0), 2.5, 1e-12);
  EXPECT_EQ(headline("tracked_los", {}, 1.0).distance(), std::nullopt) << "not recorded";
  EXPECT_EQ(headline("cn0_los_dbhz", 40.0, 40.0).distance(), std::nullopt) << "has no range";
}

TEST(ScoreCard, CountsRecordingsAndLeavesPooledRowsOut) {
  RecordingRow a, b, pooled;
  a.name = "a";
  a.key_metrics = {headline("tracked_los", 0.8, 0.85), headline("ks_cn0_los", {}, 0.3)};
  a.key_metrics[0].simulated_interval = Interval{0.7, 0.9};
  b.name = "b";
  b.key_metrics = {headline("tracked_los", 0.8, 0.5)};
  pooled = a;
  pooled.pooled = {"a", "b"};
  const std::string card = score_card({a, b, pooled});
  EXPECT_THAT(
      card, HasSubstr("tracked_los          within 0.1   0.85 (0.80), 0.70 to 0.90: yes  0.50 (0.80): no\n"));
  EXPECT_THAT(card, HasSubstr("within their ranges               1 of 2                          0 of 1\n\n"
                              "Score: 1 of 3 metrics"));
}

TEST(ScoreCard, SeedsStandBelowEachOther) {
  RecordingRow good, bad;
  good.name = bad.name = "drive";
  good.key_metrics = {headline("tracked_los", 0.8, 0.85)};
  bad.key_metrics = {headline("tracked_los", 0.8, 0.5)};
  EXPECT_EQ(seed_scores({{3, {good}}, {4, {bad}}}),
            "seed  drive   all\n   3  1 of 1  1 of 1\n   4  0 of 1  0 of 1\n\n"
            "Mean of 2 seeds: 50 % of the metrics within their ranges.\n");
}

}  // namespace
}  // namespace canyon::validation
