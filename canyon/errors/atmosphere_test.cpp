#include "canyon/errors/atmosphere.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "canyon/geodesy/constants.hpp"
#include "canyon/gnss/satellite_id.hpp"

namespace canyon::errors {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;
using geodesy::radians;

// Header of a Hong Kong navigation file of 2019-04-28 (GPSA, GPSB).
const gnss::Klobuchar kModel{{9.3132e-9, 1.4901e-8, -5.9605e-8, -1.1921e-7},
                             {8.8064e4, 4.9152e4, -1.3107e5, -3.2768e5}};
const double kL1 = gnss::l1_frequency_hz(gnss::System::GPS);
const Geodetic kHongKong = Geodetic::from_degrees(22.298251, 114.178761, 20);

// IS-GPS-200, 20.3.3.5.2.5: at night the vertical delay is 5 ns; the obliquity factor at the zenith is
// 1 + 16 * 0.03^3.
TEST(Klobuchar, IsFiveNanosecondsAtNight) {
  // 02:00 local time at 114 deg east is 18:24 GPST of the day before.
  const GpsTime t = GpsTime::from_week(2051, 18.4 * 3600);
  EXPECT_NEAR(klobuchar_delay_m(kModel, t, kHongKong, 0, geodesy::kPi / 2, kL1),
              5e-9 * geodesy::kSpeedOfLight * (1 + 16 * 0.03 * 0.03 * 0.03), 1e-12);
}

TEST(Klobuchar, FallsWithTheSquareOfTheFrequency) {
  const GpsTime t = GpsTime::from_week(2051, 6.0 * 3600);
  const double l1 = klobuchar_delay_m(kModel, t, kHongKong, 1, 0.5, kL1);
  const double b1i = klobuchar_delay_m(kModel, t, kHongKong, 1, 0.5, 1561.098e6);
  EXPECT_GT(l1, 3);
  EXPECT_NEAR(b1i / l1, std::pow(1575.42 / 1561.098, 2), 1e-12);
}

TEST(Klobuchar, FollowsTheLocalClockNotGreenwich) {
  // The maximum lies at 14:00 local time, which at 114 deg east is about 06:23 GPST.
  double best = 0;
  double best_hour = 0;
  for (double hour = 0; hour < 24; hour += 0.1) {
    const double delay =
        klobuchar_delay_m(kModel, GpsTime::from_week(2051, hour * 3600), kHongKong, 0, geodesy::kPi / 2, kL1);
    if (delay > best) {
      best = delay;
      best_hour = hour;
    }
  }
  EXPECT_NEAR(best_hour, 14 - 114.178761 / 15, 0.11);
}

TEST(Saastamoinen, IsTwoAndAHalfMetresAtTheZenithOfTheSea) {
  // Hydrostatic 0.0022768 * 1013.25 = 2.307 m at 45 deg latitude; wet about 0.12 m at 70 % humidity.
  const Geodetic sea = Geodetic::from_degrees(45, 0, 0);
  EXPECT_NEAR(saastamoinen_delay_m(sea, geodesy::kPi / 2, 0), 0.0022768 * 1013.25, 1e-12);
  EXPECT_NEAR(saastamoinen_delay_m(sea, geodesy::kPi / 2), 2.42, 0.02);
  EXPECT_NEAR(saastamoinen_delay_m(sea, radians(30)), 2 * saastamoinen_delay_m(sea, geodesy::kPi / 2), 1e-12);
}

TEST(Atmosphere, IsNothingBelowTheHorizon) {
  const GpsTime t = GpsTime::from_week(2051, 0);
  EXPECT_EQ(klobuchar_delay_m(kModel, t, kHongKong, 1, 0, kL1), 0);
  EXPECT_EQ(klobuchar_delay_m(kModel, t, kHongKong, 1, -0.3, kL1), 0);
  EXPECT_EQ(saastamoinen_delay_m(kHongKong, 0), 0);
  EXPECT_EQ(saastamoinen_delay_m(kHongKong, -1), 0);
}

// Pressures of the U.S. Standard Atmosphere, 1976, table I: 10 km 264.99 hPa, 15 km 121.11, 20 km 55.29.
TEST(Saastamoinen, FallsWithTheAirAboveTheReceiver) {
  const auto dry_zenith_m = [](double height_m) {
    return saastamoinen_delay_m(Geodetic::from_degrees(45, 0, height_m), geodesy::kPi / 2, 0);
  };
  for (const auto& [height_m, pressure_hpa] : {std::pair(10e3, 264.99), {15e3, 121.11}, {20e3, 55.29}}) {
    EXPECT_NEAR(dry_zenith_m(height_m), 0.0022768 * pressure_hpa, 0.02 * 0.0022768 * pressure_hpa)
        << height_m;
  }
  double before = saastamoinen_zenith_m(Geodetic::from_degrees(22, 114, -500));
  EXPECT_GT(before, 2.3);
  for (double height_m = -490; height_m <= 60e3; height_m += 10) {
    const double here = saastamoinen_zenith_m(Geodetic::from_degrees(22, 114, height_m));
    EXPECT_LE(here, before) << height_m;
    EXPECT_GT(here, before - 4.5e-3) << height_m;  // the steepest place is sea level
    before = here;
  }
  EXPECT_GT(before, 0);
  EXPECT_LT(before, 1e-3);
}

}  // namespace
}  // namespace canyon::errors
