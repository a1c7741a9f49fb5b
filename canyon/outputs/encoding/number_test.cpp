#include "canyon/outputs/encoding/number.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>
#include <string>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"
#include "canyon/outputs/encoding/track.hpp"

namespace canyon::encoding {
namespace {

using geodesy::GpsTime;

TEST(Number, FixedIsEmptyWhereNotKnown) {
  EXPECT_EQ(fixed(1.25, 1), "1.2");  // exactly half: to even, as printf
  EXPECT_EQ(fixed(-0.00004, 4), "0.0000");
  EXPECT_EQ(fixed(-0.00006, 4), "-0.0001");
  EXPECT_EQ(fixed(-0.0, 0), "0");
  EXPECT_EQ(fixed(std::numeric_limits<double>::quiet_NaN(), 3), "");
  EXPECT_EQ(fixed(-std::numeric_limits<double>::infinity(), 3), "");
}

// The C library rounds the exact binary value.
TEST(Number, FixedIsWhatPrintfPrints) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 200'000; ++i) {
    const int decimals = i % 17;
    const double size = std::pow(10, static_cast<double>(random() % 20) - 6);
    double value = size * (static_cast<double>(random() >> 11) * 0x1p-53 - 0.5);
    if (i % 3 == 0) value = std::round(value * 64) / 64;  // often in the middle of two numbers
    std::array<char, 64> text{};
    (void)std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
    std::string expected = text.data();
    if (expected.find_first_not_of("-0.") == std::string::npos && expected[0] == '-') expected.erase(0, 1);
    ASSERT_EQ(fixed(value, decimals), expected) << decimals;
  }
}

TEST(Number, SecondsOfWeekAreExact) {
  EXPECT_EQ(seconds_of_week(GpsTime::from_week(2051, 46701)), "46701.000");
  EXPECT_EQ(seconds_of_week(GpsTime::from_week(2051, 46701), 0), "46701");
  EXPECT_EQ(seconds_of_week(GpsTime::from_week(2051, 46701.05)), "46701.050");
  const GpsTime last = GpsTime::from_nanoseconds(2052 * GpsTime::kNanosecondsPerWeek - 1);
  EXPECT_EQ(seconds_of_week(last), "604799.999999999");
  EXPECT_EQ(seconds_of_week(GpsTime::from_nanoseconds(100'000)), "0.0001");
}

TEST(Words, AzimuthStaysBelow360AfterRounding) {
  EXPECT_EQ(wrapped_azimuth_deg(geodesy::radians(359.6), 0), 0.0);
  EXPECT_NEAR(wrapped_azimuth_deg(geodesy::radians(359.4), 0), 359.4, 1e-9);
  EXPECT_NEAR(wrapped_azimuth_deg(geodesy::radians(-90.0), 0), 270.0, 1e-9);
}

TEST(Statistics, WidthCountsCharacters) {
  EXPECT_EQ(display_width("rover"), 5U);
  EXPECT_EQ(display_width("r\xC3\xB6ver"), 5U);
}

TEST(Track, ErrorClassesAreHalfOpen) {
  EXPECT_EQ(error_class(0), 0U);
  EXPECT_EQ(error_class(1.999), 0U);
  EXPECT_EQ(error_class(2), 1U);
  EXPECT_EQ(error_class(30), 4U);
  EXPECT_EQ(error_class(1e9), 4U);
  EXPECT_EQ(error_class(std::numeric_limits<double>::quiet_NaN()), 4U);
}

TEST(Track, XmlEscapes) {
  EXPECT_EQ(xml_escaped("a<b>&\"c'\x01"), "a&lt;b&gt;&amp;&quot;c&apos;");
}

}  // namespace
}  // namespace canyon::encoding
