#include "canyon/geodesy/stray_times.hpp"

#include <gmock/gmock.h>

#include <vector>

namespace canyon::geodesy {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// The numbers of the records that are left out, of records at so many seconds.
std::vector<std::size_t> left_out(const std::vector<double>& seconds,
                                  std::span<const StandsApart> rules = kStandsApart) {
  struct Record {
    std::size_t number;
    double second;
  };
  std::vector<Record> records;
  for (const double second : seconds) records.push_back({records.size(), second});
  std::vector<std::size_t> numbers;
  leave_out_stray_times(
      records, [](const Record& record) { return GpsTime::from_week(2000, record.second); },
      [&](const Record& record) { numbers.push_back(record.number); }, rules);
  EXPECT_EQ(records.size() + numbers.size(), seconds.size());
  for (std::size_t i = 1; i < records.size(); ++i) EXPECT_LT(records[i - 1].second, records[i].second);
  return numbers;
}

TEST(StrayTimes, AreTheFewestWithoutWhichTheRestRises) {
  EXPECT_THAT(left_out({1, 2, 3}), IsEmpty());
  EXPECT_THAT(left_out({1, 2, 2, 3, 1, 4}), ElementsAre(2, 4));
  EXPECT_THAT(left_out({9, 1, 2, 3}), ElementsAre(0));
  EXPECT_THAT(left_out({}), IsEmpty());
}

TEST(StrayTimes, AreGroupsThatStandApart) {
  constexpr double kDay = 86'400;
  EXPECT_THAT(left_out({0, 1, 2, 3, 3 + 1.1 * kDay}), ElementsAre(4));
  EXPECT_THAT(left_out({0, 1, 2, 3 + 1.1 * kDay}), IsEmpty()) << "too few others";
  const StandsApart apart{10, 4, 2};
  EXPECT_THAT(left_out({0, 20, 21, 22, 23, 24, 25, 26, 27, 28}, {&apart, 1}), ElementsAre(0));
  EXPECT_THAT(left_out({0, 1, 2, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31}, {&apart, 1}), IsEmpty())
      << "three are not few";
}

}  // namespace
}  // namespace canyon::geodesy
