#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "canyon/outputs/encoding/summary.hpp"
#include "tests/support/sample_signals.hpp"

namespace canyon::encoding {
namespace {

using testing::HasSubstr;

/// `fix[i]` at second i, horizontal error i metres (north), vertical error -2 i.
std::vector<RunSummary> run(const std::vector<bool>& fix) {
  SummarySink sink({"rover"});
  for (std::size_t i = 0; i < fix.size(); ++i) {
    const auto n = static_cast<double>(i);
    sink.write(test::sample_epoch(test::sample_time() + n, test::sample_point(), {0, n, -2 * n}, fix[i]));
  }
  sink.finish();
  return sink.summaries();
}

TEST(Summary, FiguresOfARunWithAnOutage) {
  const auto summaries = run({true, true, false, false, false, true, true, false});
  ASSERT_EQ(summaries.size(), 1U);
  const RunSummary& s = summaries.front();
  EXPECT_EQ(s.receiver, "rover");
  EXPECT_EQ(s.epochs, 8U);
  EXPECT_EQ(s.fixes, 4U);
  // Horizontal errors 0, 1, 5, 6: numpy.percentile(..., [50, 95]) = 3, 5.85.
  EXPECT_NEAR(s.horizontal_p50_m, 3, 1e-12);
  EXPECT_NEAR(s.horizontal_p95_m, 5.85, 1e-12);
  EXPECT_NEAR(s.horizontal_max_m, 6, 1e-12);
  EXPECT_NEAR(s.vertical_p50_m, 6, 1e-12);
  EXPECT_NEAR(s.vertical_p95_m, 11.7, 1e-12);
  EXPECT_EQ(s.mean_visible, 10);
  EXPECT_EQ(s.mean_blocked, 1);
  EXPECT_EQ(s.mean_used, 4.5);  // 9 in half of the epochs
  // 11 satellites are above the mask: 7 LOS, 1 LOS+multipath, 2 NLOS, 1 blocked.
  EXPECT_NEAR(s.los_fraction, 7.0 / 11, 1e-12);
  EXPECT_NEAR(s.los_multipath_fraction, 1.0 / 11, 1e-12);
  EXPECT_NEAR(s.nlos_fraction, 2.0 / 11, 1e-12);
  EXPECT_NEAR(s.blocked_fraction, 1.0 / 11, 1e-12);
  EXPECT_EQ(s.median_hdop, 1.25);
  EXPECT_EQ(s.longest_outage_s, 3);  // from second 2 to the fix at second 5
}

TEST(Summary, OutageAtTheEndLastsOneIntervalBeyondItsLastEpoch) {
  EXPECT_EQ(run({true, false, false}).front().longest_outage_s, 2);
  EXPECT_EQ(run({true, true}).front().longest_outage_s, 0);
}

TEST(Summary, WithoutAFixErrorsAreNotANumber) {
  const RunSummary s = run({false, false}).front();
  EXPECT_EQ(s.fixes, 0U);
  EXPECT_TRUE(std::isnan(s.horizontal_p50_m));
  EXPECT_TRUE(std::isnan(s.vertical_p95_m));
  EXPECT_TRUE(std::isnan(s.median_hdop));
  EXPECT_EQ(s.mean_used, 0);
  EXPECT_EQ(s.longest_outage_s, 2);
  const std::string table = format_summary_table({s});
  EXPECT_THAT(table, testing::ContainsRegex("epochs with fix +0\nepochs with fix .%. +0.0\n"));
  EXPECT_EQ(table.find("nan"), std::string::npos);
}

TEST(Summary, StrengthAndIntegrity) {
  SummarySink sink({"strong", "plain"});
  auto epoch = test::sample_signal_epoch(test::sample_time(), test::sample_time());
  sink.write(epoch);
  epoch.observed.fix.consistent = false;
  epoch.observed.fix.excluded.push_back(*gnss::parse_satellite("G17"));
  sink.write(epoch);
  epoch.observed.fix.consistent.reset();
  epoch.observed.fix.excluded.clear();
  sink.write(epoch);
  epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {1, 2, 3});
  epoch.receiver = 1;
  sink.write(epoch);
  const auto summaries = sink.summaries();
  // LOS 46.3, 45.3 (with multipath), 42.3, 41.3, 40.3, 38.3, 37.3, 36.3; below the mask 43.3: not measured.
  EXPECT_NEAR(summaries[0].mean_cn0_los_dbhz, 327.4 / 8, 1e-9);
  EXPECT_NEAR(summaries[0].mean_cn0_nlos_dbhz, (44.3 + 22.4) / 2, 1e-9);
  EXPECT_EQ(summaries[0].exclusions, 3U);
  EXPECT_EQ(summaries[0].raim_tested, 2U);
  EXPECT_EQ(summaries[0].inconsistent, 1U);
  EXPECT_TRUE(std::isnan(summaries[1].mean_cn0_los_dbhz));
  const std::string table = format_summary_table(summaries);
  EXPECT_THAT(table, testing::ContainsRegex("C/N0 in sight, mean .dB-Hz. +40.9 +-\n"));
  EXPECT_THAT(table, testing::ContainsRegex("C/N0 of NLOS, mean .dB-Hz. +33.4 +-\n"));
  EXPECT_THAT(table, testing::ContainsRegex("satellites excluded, in all +3 +-\n"));
  EXPECT_THAT(table, testing::ContainsRegex("epochs that failed RAIM +1 +-\n"));
  // A run without both shows neither.
  const std::string plain = format_summary_table({summaries[1]});
  EXPECT_EQ(plain.find("C/N0"), std::string::npos);
  EXPECT_EQ(plain.find("RAIM"), std::string::npos);
  EXPECT_THAT(plain, HasSubstr("satellites tracked, mean"));
}

// Horizontal errors 0, 1, 2 of the fixes during it: numpy.percentile([0, 1, 2], 95) = 1.9.
TEST(Summary, SaysWhatTheFixWasLikeDuringAFault) {
  SummarySink sink({"hit", "spared"});
  for (int i = 0; i < 6; ++i) {
    auto epoch = test::sample_epoch(test::sample_time() + i, test::sample_point(), {0, 1.0 * i, 0}, i != 3);
    if (i < 4) epoch.faults = {"storm"};
    if (i == 5) epoch.faults = {"outage 2"};
    sink.write(epoch);
    epoch.receiver = 1;
    epoch.faults.clear();
    sink.write(epoch);
  }
  const auto summaries = sink.summaries();
  ASSERT_EQ(summaries[0].faults.size(), 2U);
  EXPECT_EQ(summaries[0].faults[0].name, "storm");
  EXPECT_EQ(summaries[0].faults[0].epochs, 4U);
  EXPECT_EQ(summaries[0].faults[0].fixes, 3U);
  EXPECT_NEAR(summaries[0].faults[0].horizontal_p95_m, 1.9, 1e-12);
  EXPECT_TRUE(summaries[1].faults.empty());
  const std::string table = format_summary_table(summaries);
  EXPECT_THAT(table, testing::ContainsRegex("during storm: with fix +3 of 4 +-\n"));
  EXPECT_THAT(table, testing::ContainsRegex("during storm: error, 95 % .m. +1.900 +-\n"));
  EXPECT_THAT(table, testing::ContainsRegex("during outage 2: with fix +1 of 1 +-\n"));
}

TEST(Summary, FiguresAreNamedOnceAndSayWhatTheyAre) {
  std::set<std::string> names, kept;
  for (const SummaryMetric& metric : summary_metrics()) {
    EXPECT_TRUE(names.insert(metric.name).second) << metric.name;
    EXPECT_TRUE(*metric.kept == '\0' || kept.insert(metric.kept).second) << metric.kept;
    EXPECT_STRNE(metric.help, "") << metric.name;
  }
}

TEST(Summary, EmptyRun) {
  const auto summaries = SummarySink({"a", "b"}).summaries();
  ASSERT_EQ(summaries.size(), 2U);
  EXPECT_EQ(summaries[1].receiver, "b");
  EXPECT_TRUE(std::isnan(summaries[1].mean_visible));
  EXPECT_THAT(format_summary_table(summaries), HasSubstr("-"));
  EXPECT_EQ(format_summary_table({}), "");
}

TEST(Summary, ShowsTheFirstOfManyReceivers) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < kMaxSummarized + 5; ++i) names.push_back(fmt::format("r{}.", i));
  const std::string table = format_summary_table(SummarySink(names).summaries());
  EXPECT_THAT(table, testing::AllOf(HasSubstr("r15."), HasSubstr("5 more receivers")));
  EXPECT_EQ(table.find("r16."), std::string::npos);
  EXPECT_LT(std::count(table.begin(), table.end(), '\n'), 100);
}

TEST(Summary, TableIsAlignedAndNamesUnits) {
  auto summaries = run({true, true, false, true});
  summaries.push_back(summaries.front());
  summaries.back().receiver = "antenne arri\xC3\xA8re";  // UTF-8: one column for two bytes
  const std::string table = format_summary_table(summaries);
  EXPECT_THAT(table, HasSubstr("horizontal error, 95 % [m]"));
  EXPECT_THAT(table, testing::ContainsRegex("epochs with fix .%. +75.0 +75.0\n"));
  EXPECT_THAT(table, HasSubstr("longest outage [s]"));
  std::size_t width = 0;
  std::size_t begin = 0;
  while (begin < table.size()) {
    const std::size_t end = table.find('\n', begin);
    ASSERT_NE(end, std::string::npos);
    std::size_t columns = 0;
    for (std::size_t i = begin; i < end; ++i)
      columns += (static_cast<unsigned char>(table[i]) & 0xC0U) != 0x80U;
    if (width == 0) width = columns;
    EXPECT_EQ(columns, width) << table.substr(begin, end - begin);
    begin = end + 1;
  }
}

}  // namespace
}  // namespace canyon::encoding
