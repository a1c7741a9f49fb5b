#include "canyon/geodesy/time_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/time_scales.hpp"

namespace canyon::geodesy {
namespace {

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
}  // namespace canyon::geodesy
