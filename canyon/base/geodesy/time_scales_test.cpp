#include "canyon/base/geodesy/time_scales.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <array>
#include <filesystem>
#include <random>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::geodesy::time_scales_test {
namespace {

using std::chrono::nanoseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

constexpr std::int64_t kSecond = GpsTime::kNanosecondsPerSecond;

std::string message(std::string_view text) {
  return test::refusal([&] { (void)parse_time(text); });
}

// The first epoch of a recorded drive: week 2051, 46701 s. 2019-04-28 is 2051 weeks after 1980-01-06
// (date -u -d '1980-01-06 +2051 weeks'), GPST - UTC = 18 s (IERS Bulletin C 52).
TEST(TimeScales, KnownInstant) {
  const GpsTime t = GpsTime::from_week(2051, 46'701);
  EXPECT_EQ(utc_from_gps(t), (CalendarTime{2019, 4, 28, 12, 58, 3, 0}));
  EXPECT_EQ(calendar_from_gps(t), (CalendarTime{2019, 4, 28, 12, 58, 21, 0}));
  EXPECT_EQ(glonass_from_gps(t), (CalendarTime{2019, 4, 28, 15, 58, 3, 0}));
  EXPECT_EQ(gps_from_utc({2019, 4, 28, 12, 58, 3, 0}), t);
  EXPECT_EQ(gps_from_calendar({2019, 4, 28, 12, 58, 21, 0}), t);
  EXPECT_EQ(gps_from_bdt(695, 46'687), t);
  EXPECT_EQ(parse_time("2019-04-28T12:58:03Z"), t);
  EXPECT_EQ(format_utc(t), "2019-04-28T12:58:03.000Z");
  EXPECT_EQ(format_gpst(t, 0), "2019-04-28T12:58:21 GPST");
}

// date -u -d @X gives the calendar; 315,964,800 s is 1980-01-06. GPST has no leap seconds, so the table is
// not used.
TEST(TimeScales, CalendarAgreesWithUnixTime) {
  struct KnownValue {
    std::int64_t unix_s;
    CalendarTime calendar;
  };
  for (const KnownValue& k :
       {KnownValue{315'964'800, {1980, 1, 6, 0, 0, 0, 0}}, KnownValue{951'782'400, {2000, 2, 29, 0, 0, 0, 0}},
        KnownValue{4'107'542'399, {2100, 2, 28, 23, 59, 59, 0}},
        KnownValue{4'107'542'400, {2100, 3, 1, 0, 0, 0, 0}},
        KnownValue{-2'203'891'201, {1900, 2, 28, 23, 59, 59, 0}},
        KnownValue{-2'203'891'200, {1900, 3, 1, 0, 0, 0, 0}}}) {
    const GpsTime t = GpsTime::from_nanoseconds((k.unix_s - 315'964'800) * kSecond);
    EXPECT_EQ(calendar_from_gps(t), k.calendar);
    EXPECT_EQ(gps_from_calendar(k.calendar), t);
  }
}

// IERS Bulletin C: UTC days that begin with a new offset, TAI - UTC minus 19 s.
struct Leap {
  CalendarTime day;
  int offset;
};
const std::array<Leap, 18> kLeaps{{{{1981, 7, 1, 0, 0, 0, 0}, 1},
                                   {{1982, 7, 1, 0, 0, 0, 0}, 2},
                                   {{1983, 7, 1, 0, 0, 0, 0}, 3},
                                   {{1985, 7, 1, 0, 0, 0, 0}, 4},
                                   {{1988, 1, 1, 0, 0, 0, 0}, 5},
                                   {{1990, 1, 1, 0, 0, 0, 0}, 6},
                                   {{1991, 1, 1, 0, 0, 0, 0}, 7},
                                   {{1992, 7, 1, 0, 0, 0, 0}, 8},
                                   {{1993, 7, 1, 0, 0, 0, 0}, 9},
                                   {{1994, 7, 1, 0, 0, 0, 0}, 10},
                                   {{1996, 1, 1, 0, 0, 0, 0}, 11},
                                   {{1997, 7, 1, 0, 0, 0, 0}, 12},
                                   {{1999, 1, 1, 0, 0, 0, 0}, 13},
                                   {{2006, 1, 1, 0, 0, 0, 0}, 14},
                                   {{2009, 1, 1, 0, 0, 0, 0}, 15},
                                   {{2012, 7, 1, 0, 0, 0, 0}, 16},
                                   {{2015, 7, 1, 0, 0, 0, 0}, 17},
                                   {{2017, 1, 1, 0, 0, 0, 0}, 18}}};

TEST(LeapSeconds, EveryTableEntryRoundTripsAtItsBorder) {
  EXPECT_EQ(leap_seconds(GpsTime::from_week(-500, 0)), 0);
  EXPECT_EQ(leap_seconds(GpsTime()), 0);
  EXPECT_EQ(leap_seconds(GpsTime::from_week(4000, 0)), 18);
  for (const Leap& leap : kLeaps) {
    const GpsTime midnight = gps_from_utc(leap.day);
    EXPECT_EQ(leap_seconds(midnight), leap.offset);
    EXPECT_EQ(leap_seconds(midnight - nanoseconds(1)), leap.offset - 1);
    EXPECT_EQ(utc_from_gps(midnight), leap.day);

    // ... 23:59:58, :59, :60, 00:00:00, one second of GPST apart.
    CalendarTime c = utc_from_gps(midnight - seconds(1));
    EXPECT_EQ(c.second, 60);
    EXPECT_EQ(c.minute, 59);
    EXPECT_EQ(c.hour, 23);
    EXPECT_EQ(gps_from_utc(c), midnight - seconds(1));
    c.nanosecond = 999'999'999;
    EXPECT_EQ(gps_from_utc(c), midnight - nanoseconds(1));
    EXPECT_EQ(utc_from_gps(midnight - nanoseconds(1)), c);
    c = utc_from_gps(midnight - seconds(2));
    EXPECT_EQ(c.second, 59);
    EXPECT_EQ(gps_from_utc(c), midnight - seconds(2));

    // In Moscow the leap second is 02:59:60 of the new day.
    const CalendarTime moscow = glonass_from_gps(midnight - seconds(1));
    EXPECT_EQ(moscow.hour, 2);
    EXPECT_EQ(moscow.minute, 59);
    EXPECT_EQ(moscow.second, 60);
    EXPECT_EQ(moscow.day, leap.day.day);
  }
}

// The operating system's table, maintained by the tz project from IERS's list, has no additional entry.
TEST(LeapSeconds, AgreeWithTheSystemsList) {
  const std::filesystem::path path = "/usr/share/zoneinfo/leap-seconds.list";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "SKIPPED: no " << path << " (package tzdata)";
  TextFile file(path);
  int entries = 0;
  while (const auto line = file.next_line()) {
    const auto fields = split_blanks(*line);
    if (line->empty() || line->front() == '#' || fields.size() < 2) continue;
    // Seconds since 1900-01-01 UTC without leap seconds, and TAI - UTC from there on.
    const std::int64_t since_1900 = *parse_integer(fields[0]);
    const int offset = static_cast<int>(*parse_integer(fields[1])) - 19;
    const GpsTime linear = gps_from_calendar({1900, 1, 1, 0, 0, 0, 0}) + nanoseconds(since_1900 * kSecond);
    if (linear < GpsTime()) continue;
    ++entries;
    EXPECT_EQ(leap_seconds(linear + seconds(offset)), offset) << *line;
    EXPECT_EQ(leap_seconds(linear + seconds(offset) - nanoseconds(1)), offset - 1) << *line;
  }
  EXPECT_EQ(entries, 18);
}

TEST(TimeScales, EveryScaleRoundTripsAtRandomNanoseconds) {
  std::mt19937_64 random(4);
  // 1750 to 2210.
  std::uniform_int_distribution<std::int64_t> instant(-230LL * 365 * 86'400 * kSecond,
                                                      230LL * 365 * 86'400 * kSecond);
  for (int i = 0; i < 20'000; ++i) {
    const GpsTime t = GpsTime::from_nanoseconds(instant(random));
    EXPECT_EQ(gps_from_calendar(calendar_from_gps(t)), t);
    EXPECT_EQ(gps_from_utc(utc_from_gps(t)), t);
    EXPECT_EQ(parse_time(format_utc(t, 9)), t) << format_utc(t, 9);
    EXPECT_EQ(parse_time(format_gpst(t, 9)), t) << format_gpst(t, 9);
  }
}

TEST(TimeScales, BeiDouTime) {
  // BDS-SIS-ICD B1I, 3.3: BDT 0 is 2006-01-01 00:00:00 UTC.
  EXPECT_EQ(gps_from_bdt(0, 0), parse_time("2006-01-01T00:00:00Z"));
  EXPECT_EQ(gps_from_bdt(1, -1), gps_from_bdt(0, 604'799));
  EXPECT_THROW((void)gps_from_bdt(700, 1e300), InputError);
}

TEST(ParseTime, TakesEveryDocumentedForm) {
  const GpsTime t = GpsTime::from_week(2051, 46'701.5);
  for (const char* text :
       {"2019-04-28T12:58:03.5Z", "2019-04-28T12:58:03,5Z", "2019-04-28 12:58:03.5Z", "2019-04-28T12:58:03.5",
        "2019-04-28t12:58:03.5z", "2019-04-28T12:58:03.500000000 UTC", "  2019-04-28T12:58:03.5Z ",
        "2019-04-28T20:58:03.5+08:00", "2019-04-28T20:58:03.5+0800", "2019-04-28T20:58:03.5+08",
        "2019-04-28T07:28:03.5-05:30", "2019-04-28T12:58:21.5 GPST", "2019-04-28T12:58:21.5GPS",
        "2019-04-29T02:58:03.5+14:00", "2019-04-28T14:58:03.5+02:00[Europe/Berlin]",
        "2019-04-28T12:58:03.5Z[Europe/Berlin]", "2019-04-28T14:58:03.5+02:00[Europe/Berlin][u-ca=iso8601]",
        "2019-04-28T12:58:03.5Z[!u-ca=iso8601]", "2019-04-28T12:58:03.5-00:00[America/Port-au-Prince]"}) {
    EXPECT_EQ(parse_time(text), t) << text;
  }
  EXPECT_EQ(parse_time("2019-04-28"), gps_from_utc({2019, 4, 28, 0, 0, 0, 0}));
  EXPECT_EQ(parse_time("2019-04-28 GPST"), gps_from_calendar({2019, 4, 28, 0, 0, 0, 0}));
  EXPECT_EQ(parse_time("2019-04-28T12:58Z"), gps_from_utc({2019, 4, 28, 12, 58, 0, 0}));
  EXPECT_EQ(parse_time("20190428T125803.5Z"), parse_time("2019-04-28T12:58:03.5Z"));
  EXPECT_EQ(parse_time("20190428T1258Z"), parse_time("2019-04-28T12:58Z"));
  EXPECT_EQ(parse_time("20190428T205803+0800"), parse_time("2019-04-28T12:58:03Z"));
  EXPECT_EQ(parse_time("20190428"), parse_time("2019-04-28"));
  EXPECT_EQ(parse_time("2019-04-28T12:58:03.000000001Z"), t - nanoseconds(499'999'999));
}

TEST(ParseTime, LeapSecond) {
  const GpsTime leap = GpsTime::from_week(1930, 17);  // 2017-01-01T00:00:17 GPST
  EXPECT_EQ(parse_time("2016-12-31T23:59:60Z"), leap);
  EXPECT_EQ(format_utc(leap, 0), "2016-12-31T23:59:60Z");
  EXPECT_EQ(parse_time("2017-01-01T00:00:00Z"), leap + seconds(1));
  EXPECT_EQ(parse_time("2017-01-01T07:59:60+08:00"), leap);
  // Either side of it, in zones where the date differs.
  EXPECT_EQ(parse_time("2017-01-01T00:30:00+01:00"), parse_time("2016-12-31T23:30:00Z"));
  EXPECT_EQ(parse_time("2016-12-31T23:30:00-01:00"), parse_time("2017-01-01T00:30:00Z"));
  EXPECT_THAT(message("2018-12-31T23:59:60Z"), HasSubstr("there was no leap second"));
  EXPECT_THAT(message("2016-12-31T23:58:60Z"), HasSubstr("there was no leap second"));
  EXPECT_THAT(message("2016-12-31T23:59:60 GPST"), HasSubstr("second 60 is out of range"));
  EXPECT_THAT(message("2016-12-31T23:59:61Z"), HasSubstr("second 61 is out of range"));
}

// RFC 9557, 3.3: a time with an unknown suffix with '!' is rejected; 4.1: an offset or Z is before it.
TEST(ParseTime, RefusesSuffixesThatMustBeUnderstood) {
  EXPECT_THAT(message("2019-04-28T12:58:03Z[!x-foo=bar]"), HasSubstr("'[!x-foo=bar]' of a time is "));
  EXPECT_THAT(message("2019-04-28T14:58:03+02:00[!Europe/Berlin][u-ca=iso8601]"),
              HasSubstr("'[!Europe/Berlin]' of a time is mandatory"));
  EXPECT_THAT(message("2019-04-28T14:58:03[Europe/Berlin]"), HasSubstr("no offset from UTC"));
  for (const char* text : {"2019-04-28T12:58:03Z[]", "2019-04-28T12:58:03Z[Europe/Berlin",
                           "2019-04-28T12:58:03Z]", "2019-04-28T12:58:03Z[Europe/Berlin]+02:00"})
    EXPECT_THAT(message(text), HasSubstr("is not a time")) << text;
}

TEST(ParseTime, RefusesEverythingElse) {
  for (const char* text : {"",
                           "now",
                           "2019",
                           "2019-04",
                           "2019-4-28",
                           "19-04-28",
                           "2019/04/28",
                           "28.04.2019",
                           "2019-04-28T",
                           "2019-04-28T12",
                           "2019-04-28T12:5",
                           "2019-04-28T12:58:3",
                           "2019-04-28T12:58:03.",
                           "2019-04-28T12:58:03.1234567890Z",
                           "2019-04-28T12:58:03X",
                           "2019-04-28T12:58:03ZZ",
                           "2019-04-28T12:58:03+8",
                           "2019-04-28T12:58:03+08:0",
                           "2019-04-28T12:58:03+08:",
                           "2019-04-28T12:58:03+15:00",
                           "2019-04-28T12:58:03+08:60",
                           "2019-04-28T12:58:03 TAI",
                           "+2019-04-28",
                           "-019-04-28",
                           "2019-04-28T-1:00:00",
                           "201904-28T12:58:03Z",
                           "2019-0428T12:58:03Z",
                           "20190428T12:58:03Z",
                           "20190428T1258:03Z",
                           "2019-04-28T125803Z",
                           "1556456283"}) {
    EXPECT_THAT(message(text), HasSubstr("is not a time; write UTC as")) << text;
  }
  EXPECT_THAT(message("2019-02-29"), HasSubstr("day 29 is out of range; it runs from 1 to 28"));
  EXPECT_THAT(message("2020-02-30"), HasSubstr("it runs from 1 to 29"));
  EXPECT_THAT(message("1900-02-29"), HasSubstr("it runs from 1 to 28"));
  EXPECT_THAT(message("2019-13-01"), HasSubstr("month 13 is out of range"));
  EXPECT_THAT(message("2019-00-01"), HasSubstr("month 0 is out of range"));
  EXPECT_THAT(message("2019-04-28T24:00:00Z"), HasSubstr("hour 24 is out of range"));
  EXPECT_THAT(message("2019-04-28T12:60:00Z"), HasSubstr("minute 60 is out of range"));
  EXPECT_THAT(message("1699-01-01"), HasSubstr("year 1699 is out of range"));
  EXPECT_THAT(message("2261-01-01"), HasSubstr("year 2261 is out of range"));
}

TEST(FormatTime, CutsDecimals) {
  const GpsTime t = GpsTime::from_week(2051, 46'701) + nanoseconds(999'999'999);
  EXPECT_EQ(format_utc(t, 0), "2019-04-28T12:58:03Z");
  EXPECT_EQ(format_utc(t, 1), "2019-04-28T12:58:03.9Z");
  EXPECT_EQ(format_utc(t, 9), "2019-04-28T12:58:03.999999999Z");
  EXPECT_EQ(format_gpst(t, 3), "2019-04-28T12:58:21.999 GPST");
  EXPECT_EQ(format_gpst(GpsTime::from_nanoseconds(-1), 3), "1980-01-05T23:59:59.999 GPST");
  EXPECT_EQ(format_gpst(gps_from_calendar({1702, 3, 4, 5, 6, 7, 80'000'000}), 2),
            "1702-03-04T05:06:07.08 GPST");
}

TEST(CalendarTime, FieldsAreChecked) {
  EXPECT_THROW((void)gps_from_calendar({2019, 4, 31, 0, 0, 0, 0}), InputError);
  EXPECT_THROW((void)gps_from_calendar({2019, 4, 30, 0, 0, 60, 0}), InputError);
  EXPECT_THROW((void)gps_from_calendar({2019, 4, 30, 0, 0, 0, 1'000'000'000}), InputError);
  EXPECT_THROW((void)gps_from_calendar({2019, 4, 30, 0, 0, 0, -1}), InputError);
  EXPECT_THROW((void)gps_from_utc({2019, 4, 30, 0, -1, 0, 0}), InputError);
}

// date -u -d @1556456283.25: 2019-04-28 12:58:03; @1483228799: 2016-12-31 23:59:59, a second before the last
// leap second, @1483228800: 2017-01-01.
TEST(TimeScales, FromPosixTime) {
  EXPECT_EQ(gps_from_unix(1556456283'250'000'000), parse_time("2019-04-28T12:58:03.25Z"));
  EXPECT_EQ(gps_from_unix(1483228799'000'000'000), parse_time("2016-12-31T23:59:59Z"));
  EXPECT_EQ(gps_from_unix(1483228800'000'000'000), parse_time("2017-01-01T00:00:00Z"));
  EXPECT_EQ(gps_from_unix(315964800'000'000'000), GpsTime());
}

TEST(Rollover, WeeksThatAReceiverLost) {
  // 7,168 days are 1,024 weeks: 2004-09-15 and 2024-05-01.
  const GpsTime now = parse_time("2024-05-01T10:00:00Z"), lost = parse_time("2004-09-15T10:00:00Z");
  EXPECT_EQ(rollover_text(lost, now),
            "; 1024 weeks later it would be near: has a receiver's GPS week rolled over?");
  EXPECT_EQ(rollover_text(now, lost),
            "; 1024 weeks earlier it would be near: has a receiver's GPS week rolled over?");
  EXPECT_NE(rollover_text(lost + 7 * 86'400.0, now), "");
  EXPECT_EQ(rollover_text(lost + 9 * 86'400.0, now), "");
  EXPECT_EQ(rollover_text(now, now), "");
}

TEST(TimeText, KnowsWhetherAZoneIsNamed) {
  for (const char* text :
       {"2019-04-28T12:58:03Z", "2019-04-28T12:58:03.5Z ", "2019-04-28T12:58:03+08:00",
        "2019-04-28T12:58:03-0500", "2019-04-28T12:58:03 GPST", "2019-04-28 GPS", "2019-04-28T12:58 UTC"}) {
    EXPECT_TRUE(names_time_scale(text)) << text;
    EXPECT_NO_THROW((void)parse_time(text)) << text;
  }
  for (const char* text : {"2019-04-28T12:58:03", " 2019-04-28 12:58:03.25 ", "2019-04-28"}) {
    EXPECT_FALSE(names_time_scale(text)) << text;
    EXPECT_NO_THROW((void)parse_time(text)) << text;
  }
}

// Week 0 begins on 1980-01-06 00:00:00 GPST (IS-GPS-200, 20.3.3.3.1.1); week 10,000 is 70,000 days later:
// date -d '1980-01-06 70000 days' is 2171-09-01.
TEST(TimeText, SimulatedTimesAreTheWeeks0To9999) {
  EXPECT_EQ(parse_simulated_time("1980-01-06 GPST"), GpsTime{});
  EXPECT_EQ(parse_simulated_time("2171-08-31T23:59:59 GPST"), GpsTime::from_week(9999, 604'799));
  EXPECT_EQ(parse_simulated_time("2019-04-28T12:58:03Z"), parse_time("2019-04-28T12:58:03Z"));
  for (const char* text : {"1980-01-05T23:59:59Z", "1975-06-01T00:00:00Z", "1700-01-01", "1650-01-01",
                           "2171-09-01 GPST", "2260-01-01", "9999-12-31T00:00:00Z"}) {
    try {
      (void)parse_simulated_time(text);
      ADD_FAILURE() << text;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr(text), testing::HasSubstr("1980-01-06"),
                                               testing::HasSubstr("2171-08-31")));
    }
  }
  EXPECT_THROW((void)parse_simulated_time("soon"), InputError);
  EXPECT_THROW((void)parse_simulated_time(""), InputError);
}

}  // namespace
}  // namespace canyon::geodesy::time_scales_test
