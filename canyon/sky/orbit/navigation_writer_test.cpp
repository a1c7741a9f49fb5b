#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <sstream>

#include "canyon/base/input_error.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/navigation_writer.hpp"
#include "tests/support/rinex_sample.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::orbit {
namespace {

gnss::NavigationData read(const std::string& text) {
  return rinex::read_rinex_navigation(TextFile::from_string(text, "sky.rnx"));
}

// Every number of a record except `source`.
template <typename Ephemeris>
void expect_same(const Ephemeris& a, const Ephemeris& b);

template <>
void expect_same(const gnss::KeplerEphemeris& a, const gnss::KeplerEphemeris& b) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.toc, b.toc);
  EXPECT_EQ(a.toe, b.toe);
  EXPECT_EQ(a.transmission, b.transmission);
  const auto numbers = [](const gnss::KeplerEphemeris& e) {
    return std::vector<double>{e.af0,
                               e.af1,
                               e.af2,
                               e.sqrt_a,
                               e.eccentricity,
                               e.inclination,
                               e.inclination_rate,
                               e.right_ascension,
                               e.right_ascension_rate,
                               e.argument_of_perigee,
                               e.mean_anomaly,
                               e.mean_motion_difference,
                               e.cuc,
                               e.cus,
                               e.cic,
                               e.cis,
                               e.crc,
                               e.crs,
                               e.group_delay[0],
                               e.group_delay[1],
                               static_cast<double>(e.iode),
                               static_cast<double>(e.iodc),
                               static_cast<double>(e.health),
                               e.accuracy_m,
                               e.fit_interval_h,
                               static_cast<double>(e.data_sources),
                               static_cast<double>(e.l2p_flag)};
  };
  EXPECT_EQ(numbers(a), numbers(b)) << to_string(a.id);
}

template <>
void expect_same(const gnss::GlonassEphemeris& a, const gnss::GlonassEphemeris& b) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.toe, b.toe);
  EXPECT_EQ(a.transmission, b.transmission) << to_string(a.id);
  EXPECT_EQ(a.clock_bias_s, b.clock_bias_s);
  EXPECT_EQ(a.frequency_bias, b.frequency_bias);
  EXPECT_EQ(a.position_m, b.position_m);
  EXPECT_EQ(a.velocity_mps, b.velocity_mps);
  EXPECT_EQ(a.acceleration_mps2, b.acceleration_mps2);
  EXPECT_EQ(a.health, b.health);
  EXPECT_EQ(a.channel, b.channel);
  EXPECT_EQ(a.age_days, b.age_days);
}

template <>
void expect_same(const gnss::SbasEphemeris& a, const gnss::SbasEphemeris& b) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.toe, b.toe);
  EXPECT_EQ(a.transmission, b.transmission) << to_string(a.id);
  EXPECT_EQ(a.clock_bias_s, b.clock_bias_s);
  EXPECT_EQ(a.clock_drift, b.clock_drift);
  EXPECT_EQ(a.position_m, b.position_m);
  EXPECT_EQ(a.velocity_mps, b.velocity_mps);
  EXPECT_EQ(a.acceleration_mps2, b.acceleration_mps2);
  EXPECT_EQ(a.health, b.health);
  EXPECT_EQ(a.accuracy_m, b.accuracy_m);
  EXPECT_EQ(a.iodn, b.iodn);
}

void expect_round_trip(const gnss::NavigationData& data) {
  const gnss::NavigationData back = read(rinex::format_rinex_navigation(data));
  EXPECT_TRUE(back.report.lines().empty());
  ASSERT_EQ(back.kepler.size(), data.kepler.size());
  for (std::size_t i = 0; i < data.kepler.size(); ++i) expect_same(data.kepler[i], back.kepler[i]);
  ASSERT_EQ(back.glonass.size(), data.glonass.size());
  for (std::size_t i = 0; i < data.glonass.size(); ++i) expect_same(data.glonass[i], back.glonass[i]);
  ASSERT_EQ(back.sbas.size(), data.sbas.size());
  for (std::size_t i = 0; i < data.sbas.size(); ++i) expect_same(data.sbas[i], back.sbas[i]);
  EXPECT_EQ(back.leap_seconds, data.leap_seconds);
  EXPECT_EQ(back.galileo_nequick.has_value(), data.galileo_nequick.has_value());
  ASSERT_EQ(back.klobuchar.size(), data.klobuchar.size());
}

TEST(RinexNavigationWriter, SampleComesBackExactly) {
  const gnss::NavigationData data = read(test::kRinex3Sample + test::kS23);
  expect_round_trip(data);
  const gnss::NavigationData back = read(rinex::format_rinex_navigation(data));
  for (const auto& [system, k] : data.klobuchar) {
    EXPECT_EQ(back.klobuchar.at(system).alpha, k.alpha);
    EXPECT_EQ(back.klobuchar.at(system).beta, k.beta);
  }
  EXPECT_EQ(back.galileo_nequick, data.galileo_nequick);
}

// One test for each file: a missing file skips only its own test.
class RealDay : public testing::TestWithParam<const char*> {};
TEST_P(RealDay, ComesBackExactly) {
  CANYON_SHARED_DATA(path, GetParam());
  expect_round_trip(rinex::read_rinex_navigation(path));
}
INSTANTIATE_TEST_SUITE_P(RinexNavigationWriter, RealDay, testing::ValuesIn(test::kRealDays));

TEST(RinexNavigationWriter, LayoutIsRinex304) {
  const std::string text = rinex::format_rinex_navigation(read(test::kRinex3Sample + test::kS23));
  std::istringstream lines(text);
  std::string line;
  bool header = true;
  std::string order;
  while (std::getline(lines, line)) {
    if (header) {
      EXPECT_EQ(line.size(), 80u) << line;
      header = line.substr(60, 13) != "END OF HEADER";
    } else {
      EXPECT_LE(line.size(), 80u) << line;
      if (line[0] != ' ') order += line.substr(0, 3);
    }
  }
  EXPECT_EQ(text.substr(0, 80),
            "     3.04           N: GNSS NAV DATA    M: MIXED            RINEX VERSION / TYPE");
  EXPECT_EQ(order, "G05R07E11C03C21J02S23");
  EXPECT_THAT(text,
              testing::HasSubstr(
                  "G05 2019 04 28 12 00 00-1.234567890123E-04 3.410605131648E-13 0.000000000000E+00\n"));
  // Seconds of the UTC week; BeiDou's own week and seconds.
  EXPECT_THAT(text, testing::HasSubstr("R07 2019 04 28 11 45 00 6.355904042721E-05-9.094947017729E-13 "
                                       "4.230000000000E+04\n"));
  EXPECT_THAT(text, testing::HasSubstr(" 0.000000000000E+00 6.950000000000E+02 0.000000000000E+00\n"));
}

TEST(RinexNavigationWriter, MessageOfTheWeekBefore) {
  gnss::NavigationData data = read(test::kRinex3Header + test::kG05);
  data.kepler[0].toe = data.kepler[0].toc = geodesy::GpsTime::from_week(2051, 0);
  data.kepler[0].transmission = geodesy::GpsTime::from_week(2050, 600'000);
  expect_round_trip(data);
}

TEST(RinexNavigationWriter, ComputedOrbitsLoseLessThanATenthOfAMillimetre) {
  gnss::NavigationData data = read(test::kRinex3Sample);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> last_digits(1 - 1e-9, 1 + 1e-9);  // beyond the digits of RINEX
  for (gnss::KeplerEphemeris& e : data.kepler) {
    for (double* value :
         {&e.af0, &e.sqrt_a, &e.eccentricity, &e.inclination, &e.right_ascension, &e.mean_anomaly,
          &e.argument_of_perigee, &e.mean_motion_difference, &e.crs, &e.cuc}) {
      *value *= last_digits(random);
    }
  }
  const gnss::NavigationData back = read(rinex::format_rinex_navigation(data));
  ASSERT_EQ(back.kepler.size(), data.kepler.size());
  for (std::size_t i = 0; i < data.kepler.size(); ++i) {
    const gnss::KeplerEphemeris& e = data.kepler[i];
    const SatelliteState before = propagate(e, e.toe + 7200.0),
                         after = propagate(back.kepler[i], e.toe + 7200.0);
    EXPECT_GT((before.position_m - after.position_m).norm(), 0);
    EXPECT_LT((before.position_m - after.position_m).norm(), 1e-4);
    EXPECT_NEAR(before.clock_bias_s, after.clock_bias_s, 1e-15);
  }
}

TEST(RinexNavigationWriter, WhatRinexCannotHoldIsRefused) {
  gnss::NavigationData data = read(test::kRinex3Sample);
  data.kepler[0].crs = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)rinex::format_rinex_navigation(data), InputError);
  data = read(test::kRinex3Sample);
  data.kepler[0].toc = data.kepler[0].toc + 0.5;
  EXPECT_THROW((void)rinex::format_rinex_navigation(data), InputError);
  data = read(test::kRinex3Sample);
  data.kepler[0].af2 = -1e-120;  // three exponent digits would not fit
  EXPECT_EQ(read(rinex::format_rinex_navigation(data)).kepler[0].af2, 0);
}

TEST(RinexNavigationWriter, FileIsWholeOrAbsent) {
  const test::TemporaryFolder folder;
  const gnss::NavigationData data = read(test::kRinex3Sample);
  rinex::write_rinex_navigation(folder / "brdc.rnx", data);
  EXPECT_EQ(test::read_bytes(folder / "brdc.rnx"), rinex::format_rinex_navigation(data));
  EXPECT_THROW(rinex::write_rinex_navigation(folder / "none/brdc.rnx", data), InputError);
}

}  // namespace
}  // namespace canyon::orbit
