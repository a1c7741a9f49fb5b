#include "canyon/sky/range_errors.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

namespace canyon::sky {
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

// BDS-SIS-ICD-B1I-3.0, 5.2.4.7, by a separate script: also over the end of a week of BDT, with the period at
// its limits of 172,800 and 72,000 s, and scaled to other carriers.
TEST(Klobuchar, OfBeiDouIsItsOwnFormula) {
  struct Case {
    double position_deg[2], tow_s, azimuth_deg, elevation_deg, frequency_hz;
    std::array<double, 4> beta;
    double delay_m;
  };
  const Case cases[] = {
      {{22.2983, 114.179}, 21600, 57, 30, 1561.098e6, {129020, -425980, 1.5729e+06, 3.4734e+06}, 7.905273},
      {{22.2983, 114.179}, 21600, 200, 8, 1561.098e6, {129020, -425980, 1.5729e+06, 3.4734e+06}, 14.036217},
      {{-35, 150}, 604797, 120, 60, 1176.450e6, {129020, -425980, 1.5729e+06, 3.4734e+06}, 6.938363},
      {{60, -100}, 72000, 300, 15, 1575.420e6, {129020, -425980, 1.5729e+06, 3.4734e+06}, 11.679058},
      {{22.2983, 114.179}, 36000, 57, 30, 1561.098e6, {300000, 0, 0, 0}, 7.221952},
      {{45, 10}, 36000, 10, 40, 1561.098e6, {10000, 0, 0, 0}, 3.855323},
  };
  for (const Case& c : cases) {
    const SystemKlobuchar model{gnss::System::BeiDou,
                                {{1.0245e-8, 5.2154e-8, -5.3644e-7, 1.1325e-6}, c.beta}};
    const auto delay_m = [&](const auto& coefficients) {
      return klobuchar_delay_m(coefficients, GpsTime::from_week(2244, c.tow_s),
                               Geodetic::from_degrees(c.position_deg[0], c.position_deg[1], 0),
                               radians(c.azimuth_deg), radians(c.elevation_deg), c.frequency_hz);
    };
    EXPECT_NEAR(delay_m(model), c.delay_m, 1e-5);
    EXPECT_GT(std::abs(delay_m(model.second) - c.delay_m), 0.01);  // by the formula of GPS
    EXPECT_EQ(delay_m(SystemKlobuchar{gnss::System::QZSS, model.second}), delay_m(model.second));
  }
}

TEST(Klobuchar, FollowsTheLocalClockNotGreenwich) {
  // The maximum is at 14:00 local time, which at 114 deg east is about 06:23 GPST.
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
}

// A. Niell's mapping (J. Geophys. Res. 101(B2), 1996) of 2.30 m hydrostatic and 0.12 m wet delay at the
// zenith at sea level, 30 deg north on 8 January, by a separate script.
TEST(Saastamoinen, IsMappedAsByNiell) {
  constexpr std::pair<double, double> kNiell_m[] = {{3, 35.572},  {4, 29.156}, {5, 24.564}, {6, 21.150},
                                                    {7, 18.530},  {8, 16.467}, {9, 14.807}, {10, 13.444},
                                                    {12, 11.349}, {15, 9.199}, {20, 7.012}, {30, 4.823},
                                                    {45, 3.418},  {60, 2.793}, {90, 2.420}};
  for (const auto& [elevation_deg, niell_m] : kNiell_m)
    EXPECT_NEAR(slant_delay_m(2.42, radians(elevation_deg)), niell_m, 0.17) << elevation_deg;
  for (double deg = 0.1; deg < 89.8; deg += 0.1)  // one falling curve, without a step at 4 deg
    EXPECT_LT(slant_delay_m(1, radians(deg + 0.1)), slant_delay_m(1, radians(deg))) << deg;
  EXPECT_NEAR(slant_delay_m(1, radians(2)), 18.7, 0.05);
  EXPECT_NEAR(slant_delay_m(1, geodesy::kPi / 2), 1, 1e-12);
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
    EXPECT_GT(here, before - 4.5e-3) << height_m;  // steepest at sea level
    before = here;
  }
  EXPECT_GT(before, 0);
  EXPECT_LT(before, 1e-3);
}

}  // namespace
}  // namespace canyon::sky
