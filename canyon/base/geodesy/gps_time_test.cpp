#include "canyon/base/geodesy/gps_time.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "canyon/base/input_error.hpp"

namespace canyon::geodesy {
namespace {

using std::chrono::nanoseconds;

constexpr std::int64_t kSecond = GpsTime::kNanosecondsPerSecond;

TEST(GpsTime, CountsFrom1980) {
  EXPECT_EQ(GpsTime().nanoseconds(), 0);
  EXPECT_EQ(GpsTime().week(), 0);
  EXPECT_EQ(GpsTime::from_week(1, 0).nanoseconds(), 604'800 * kSecond);
  EXPECT_EQ(GpsTime::from_week(2051, 46'701.25).nanoseconds(),
            (2051LL * 604'800 + 46'701) * kSecond + 250'000'000);
}

TEST(GpsTime, WeekAndSecondsGiveBackWhatWentIn) {
  const GpsTime t = GpsTime::from_week(2051, 604'799.999'999'999);
  EXPECT_EQ(t.week(), 2051);
  EXPECT_EQ(t.nanosecond_of_week(), 604'800 * kSecond - 1);
  EXPECT_EQ((t + nanoseconds(1)).week(), 2052);
  EXPECT_EQ((t + nanoseconds(1)).seconds_of_week(), 0);
  EXPECT_EQ(GpsTime::from_week(2051, 46'701).seconds_of_week(), 46'701);
}

TEST(GpsTime, TimesBefore1980HaveNegativeWeeks) {
  const GpsTime t = GpsTime::from_nanoseconds(-1);
  EXPECT_EQ(t.week(), -1);
  EXPECT_EQ(t.nanosecond_of_week(), 604'800 * kSecond - 1);
  EXPECT_EQ(GpsTime::from_week(-1, 604'799.999'999'999), t);
  EXPECT_EQ(GpsTime::from_week(-3, 0).week(), -3);
  EXPECT_EQ(GpsTime::from_week(-3, 0).seconds_of_week(), 0);
}

TEST(GpsTime, SecondsCarryOverWeeks) {
  EXPECT_EQ(GpsTime::from_week(10, 604'800), GpsTime::from_week(11, 0));
  EXPECT_EQ(GpsTime::from_week(10, -1), GpsTime::from_week(9, 604'799));
  EXPECT_EQ(GpsTime::from_week(10, -0.25e-9), GpsTime::from_week(10, 0));
  EXPECT_EQ(GpsTime::from_week(0, 1e9), GpsTime::from_nanoseconds(1'000'000'000 * kSecond));
  // Large terms of opposite sign add up to an ordinary time.
  EXPECT_EQ(GpsTime::from_week(15'000, -14'000.0 * 604'800), GpsTime::from_week(1000, 0));
}

TEST(GpsTime, EveryNanosecondOfAWeekSurvivesDoubleSeconds) {
  std::mt19937_64 random(1);
  std::uniform_int_distribution<std::int64_t> instant(0, GpsTime::kNanosecondsPerWeek - 1);
  for (int i = 0; i < 10'000; ++i) {
    const GpsTime t = GpsTime::from_nanoseconds(instant(random));
    EXPECT_EQ(GpsTime::from_week(2000, t.seconds_of_week()).nanosecond_of_week(), t.nanoseconds());
  }
}

TEST(GpsTime, ArithmeticIsExactOverTheWholeRange) {
  std::mt19937_64 random(2);
  // Years 1700 to 2260 and intervals up to 104 days: exact in nanoseconds in both directions.
  std::uniform_int_distribution<std::int64_t> instant(-280LL * 365 * 86'400 * kSecond,
                                                      280LL * 365 * 86'400 * kSecond);
  std::uniform_int_distribution<std::int64_t> interval(-(1LL << 53), 1LL << 53);
  for (int i = 0; i < 10'000; ++i) {
    const GpsTime t = GpsTime::from_nanoseconds(instant(random));
    const std::int64_t d = interval(random);
    const GpsTime later = t + nanoseconds(d);
    EXPECT_EQ(later.nanoseconds() - t.nanoseconds(), d);
    EXPECT_EQ(later - nanoseconds(d), t);
    // The difference is the double closest to d / 1e9, and adding it restores the same nanosecond.
    EXPECT_EQ(later - t, static_cast<double>(d) / 1e9);
    EXPECT_LE(std::abs((t + (later - t)).nanoseconds() - later.nanoseconds()), 1);
    EXPECT_EQ(GpsTime::from_nanoseconds(t.week() * GpsTime::kNanosecondsPerWeek + t.nanosecond_of_week()), t);
  }
}

TEST(GpsTime, WholeSecondsComeOutWhole) {
  const GpsTime t = GpsTime::from_week(2051, 0);
  for (int s = -100'000; s < 100'000; s += 7) EXPECT_EQ((t + static_cast<double>(s)) - t, s);
  EXPECT_EQ((t + 0.1) - t, 0.1);
  EXPECT_EQ(t - 0.3, t + -0.3);
}

TEST(GpsTime, AddedSecondsRoundToTheNearestNanosecond) {
  const GpsTime t = GpsTime::from_week(2051, 0);
  EXPECT_EQ(t + 0.4e-9, t);
  EXPECT_EQ(t + 0.6e-9, t + nanoseconds(1));
  EXPECT_EQ(t + -0.4e-9, t);
  EXPECT_EQ(t + -0.6e-9, t - nanoseconds(1));
  EXPECT_EQ(t + 0.075, t + nanoseconds(75'000'000));
}

TEST(GpsTime, Orders) {
  const GpsTime t = GpsTime::from_week(2051, 0);
  EXPECT_LT(t, t + nanoseconds(1));
  EXPECT_GT(t, GpsTime::from_week(2050, 604'799));
  EXPECT_LT(GpsTime::from_week(-1, 0), GpsTime());
  EXPECT_NE(t, GpsTime());
}

TEST(GpsTime, RefusesWhatIsNoTime) {
  const double inf = std::numeric_limits<double>::infinity();
  for (const double seconds : {inf, -inf, std::nan(""), 1e11, -1e11, 1e300}) {
    EXPECT_THROW((void)GpsTime::from_week(2051, seconds), InputError) << seconds;
  }
  EXPECT_THROW((void)GpsTime::from_week(14'601, 0), InputError);
  EXPECT_THROW((void)GpsTime::from_week(-14'601, 0), InputError);
  EXPECT_THROW((void)GpsTime::from_week(14'600, 604'800), InputError);
  EXPECT_THROW((void)GpsTime::from_week(std::numeric_limits<int>::max(), 0), InputError);
  EXPECT_THROW((void)GpsTime::from_week(std::numeric_limits<int>::min(), 0), InputError);
  EXPECT_NO_THROW((void)GpsTime::from_week(14'600, 0));
  EXPECT_NO_THROW((void)GpsTime::from_week(-14'600, 0));
}

TEST(GpsTime, IsRoundedToTheNearestStep) {
  EXPECT_EQ(round_to(GpsTime::from_nanoseconds(149), 100).nanoseconds(), 100);
  EXPECT_EQ(round_to(GpsTime::from_nanoseconds(150), 100).nanoseconds(), 200);
  EXPECT_EQ(round_to(GpsTime::from_nanoseconds(-149), 100).nanoseconds(), -100);
  EXPECT_EQ(round_to(GpsTime::from_nanoseconds(-151), 100).nanoseconds(), -200);
}

}  // namespace
}  // namespace canyon::geodesy
