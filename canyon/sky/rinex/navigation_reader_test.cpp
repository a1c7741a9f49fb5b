#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/navigation_writer.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <map>
#include <set>
#include <sstream>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "tests/support/observation_text.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/rinex_sample.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::rinex {
namespace {

using geodesy::GpsTime;
using geodesy::parse_time;
using test::kC03;
using test::kC21;
using test::kE11;
using test::kG05;
using test::kJ02;
using test::kR07;
using test::kRinex3Header;
using test::kRinex3Sample;
using test::kS23;
using test::replaced;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

gnss::NavigationData read(const std::string& text) {
  return read_rinex_navigation(TextFile::from_string(text, "sky.rnx"));
}

const gnss::KeplerEphemeris& kepler(const gnss::NavigationData& data, gnss::SatelliteId id) {
  const auto at = std::find_if(data.kepler.begin(), data.kepler.end(),
                               [id](const gnss::KeplerEphemeris& e) { return e.id == id; });
  if (at == data.kepler.end()) throw std::runtime_error("no " + to_string(id));
  return *at;
}

std::string error_of(const std::string& text) {
  return test::refusal([&] { (void)read(text); });
}

// As joined by cat: no record is lost at the joint.
TEST(RinexNavigation, FilesThatWereJoined) {
  const gnss::NavigationData once = read(kRinex3Sample);
  const gnss::NavigationData data = read(kRinex3Sample + replaced(kRinex3Header, "3.04 ", "3.05 ") +
                                         replaced(kG05, "G05", "G07") + kRinex3Sample);
  EXPECT_THAT(data.report.lines(), IsEmpty());
  EXPECT_EQ(data.kepler.size(), once.kepler.size() + 1);
  EXPECT_EQ(data.glonass.size(), once.glonass.size());
  EXPECT_EQ(kepler(data, {gnss::System::GPS, 7}).af0, kepler(once, {gnss::System::GPS, 5}).af0);
}

// Of two records of one time and issue the first one is kept.
TEST(RinexNavigation, OfTwoRecordsOfOneTimeAndIssueTheFirstStays) {
  const std::string other = replaced(kG05, "-2.157708626665", "-2.257708626665");
  EXPECT_EQ(read(kRinex3Header + kG05 + kG05).kepler.size(), 1U);
  const gnss::NavigationData data = read(kRinex3Header + other + kG05);
  ASSERT_EQ(data.kepler.size(), 1U);
  EXPECT_EQ(data.kepler[0].af0, read(kRinex3Header + other).kepler[0].af0);
}

// A Galileo satellite moves 2,201 km in the 10 minutes between two issues: 3,668 m/s, its circular speed at
// 29,600 km.
TEST(RinexNavigation, AMessageOfOneIssueIsTakenForOneOfTwo) {
  const std::string mixed = replaced(kE11, kE11.substr(0, 23), "E11 2019 04 28 12 00 00");
  ASSERT_NE(kE11.substr(0, 23), mixed.substr(0, 23));
  for (const std::string& both : {kE11 + mixed, mixed + kE11}) {
    const gnss::NavigationData data = read(kRinex3Header + both);
    ASSERT_EQ(data.kepler.size(), 1U);
    EXPECT_EQ(data.kepler[0].toc, data.kepler[0].toe);
    EXPECT_THAT(data.report.lines(), ElementsAre(HasSubstr("1 messages of two issues (toc is not toe)")));
    EXPECT_THAT(data.report.warnings(), IsEmpty());
  }
  const gnss::NavigationData alone = read(kRinex3Header + mixed);
  ASSERT_EQ(alone.kepler.size(), 1U);
  EXPECT_THAT(
      alone.report.warnings(),
      ElementsAre(AllOf(HasSubstr("1 messages whose clock (toc) and orbit (toe)"), HasSubstr("E11 at "))));
  EXPECT_THAT(read(kRinex3Header + kE11).report.lines(), IsEmpty());
}

TEST(RinexNavigation, Version3GpsRecordFieldByField) {
  const gnss::NavigationData data = read(kRinex3Sample);
  EXPECT_THAT(data.report.lines(), IsEmpty());
  EXPECT_THAT(data.sources, ElementsAre("sky.rnx"));
  EXPECT_EQ(data.kepler.size(), 5u);
  EXPECT_EQ(data.glonass.size(), 1u);
  const gnss::KeplerEphemeris& e = kepler(data, {gnss::System::GPS, 5});
  EXPECT_EQ(e.toc, parse_time("2019-04-28T12:00:00 GPST"));
  EXPECT_EQ(e.toe, GpsTime::from_week(2051, 43200));
  EXPECT_EQ(e.transmission, GpsTime::from_week(2051, 36018));
  EXPECT_EQ(e.af0, -1.234567890123e-04);
  EXPECT_EQ(e.af1, 3.410605131648e-13);
  EXPECT_EQ(e.af2, 0);
  EXPECT_EQ(e.iode, 96);
  EXPECT_EQ(e.crs, 3.384375000000e+01);
  EXPECT_EQ(e.mean_motion_difference, 4.106242470052e-09);
  EXPECT_EQ(e.mean_anomaly, -2.157708626665e+00);
  EXPECT_EQ(e.cuc, 1.812353730202e-06);
  EXPECT_EQ(e.eccentricity, 5.041313482914e-03);
  EXPECT_EQ(e.cus, 9.221956133842e-06);
  EXPECT_EQ(e.sqrt_a, 5.153679471970e+03);
  EXPECT_EQ(e.cic, 3.594905138016e-08);
  EXPECT_EQ(e.right_ascension, 2.277502707678e+00);
  EXPECT_EQ(e.cis, 2.756714820862e-08);
  EXPECT_EQ(e.inclination, 9.659928182326e-01);
  EXPECT_EQ(e.crc, 2.033437500000e+02);
  EXPECT_EQ(e.argument_of_perigee, -1.414485730254e+00);
  EXPECT_EQ(e.right_ascension_rate, -7.679605600684e-09);
  EXPECT_EQ(e.inclination_rate, 5.857386840816e-11);
  EXPECT_EQ(e.data_sources, 1);
  EXPECT_EQ(e.l2p_flag, 0);
  EXPECT_EQ(e.accuracy_m, 2.8);
  EXPECT_EQ(e.health, 0);
  EXPECT_EQ(e.group_delay[0], -1.769512891769e-08);
  EXPECT_EQ(e.iodc, 608);
  EXPECT_EQ(e.fit_interval_h, 4);
}

TEST(RinexNavigation, Version3OtherSystems) {
  const gnss::NavigationData data = read(kRinex3Sample);

  const gnss::GlonassEphemeris& r = data.glonass.front();
  EXPECT_EQ(r.id, (gnss::SatelliteId{gnss::System::GLONASS, 7}));
  EXPECT_EQ(r.toe, parse_time("2019-04-28T11:45:00Z"));
  EXPECT_EQ(r.toe, parse_time("2019-04-28T11:45:18 GPST"));
  EXPECT_EQ(r.transmission, r.toe);  // 42300 s is 11:45 of the UTC week's Sunday
  EXPECT_EQ(r.clock_bias_s, 6.355904042721e-05);
  EXPECT_EQ(r.frequency_bias, -9.094947017729e-13);
  EXPECT_DOUBLE_EQ(r.position_m[0], 1.090894238281e+07);
  EXPECT_DOUBLE_EQ(r.velocity_mps[1], 2.795855522156e+03);
  EXPECT_DOUBLE_EQ(r.acceleration_mps2[2], -2.793967723846e-06);
  EXPECT_EQ(r.health, 0);
  EXPECT_EQ(r.channel, 5);
  EXPECT_EQ(r.age_days, 1);

  const gnss::KeplerEphemeris& galileo = kepler(data, {gnss::System::Galileo, 11});
  EXPECT_EQ(galileo.toe, GpsTime::from_week(2051, 42600));
  EXPECT_EQ(galileo.data_sources, 517);
  EXPECT_FALSE(is_galileo_fnav(galileo));
  EXPECT_EQ(galileo.group_delay[0], -1.862645149231e-09);
  EXPECT_EQ(galileo.group_delay[1], -2.095475792885e-09);
  EXPECT_EQ(galileo.iodc, 0);

  const gnss::KeplerEphemeris& beidou = kepler(data, {gnss::System::BeiDou, 3});
  EXPECT_EQ(beidou.toe, parse_time("2019-04-28T12:00:14 GPST"));  // 12:00:00 BDT
  EXPECT_EQ(beidou.toc, beidou.toe);
  EXPECT_EQ(beidou.transmission, beidou.toe + 0.4);
  EXPECT_EQ(beidou.group_delay[1], -8.199999790293e-09);
  EXPECT_EQ(beidou.iode, 1);
  EXPECT_EQ(beidou.iodc, 3);

  const gnss::KeplerEphemeris& qzss = kepler(data, {gnss::System::QZSS, 2});
  EXPECT_EQ(qzss.iodc, 969);
  EXPECT_EQ(qzss.fit_interval_h, 0);
  EXPECT_EQ(qzss.l2p_flag, 1);
}

TEST(RinexNavigation, Sbas) {
  // RINEX 3.04; 2.11's GEO file, whose numbers are also PRN - 100; 4.00.
  std::string version2 =
      "     2.11           H: GEO NAV MSG DATA                     RINEX VERSION / TYPE\n"
      "                                                            END OF HEADER       \n";
  std::istringstream lines(replaced(kS23, "S23 2019 04 28 12 00 00", "X23 19  4 28 12  0  0.0"));
  for (std::string line; std::getline(lines, line);) version2 += line.substr(1) + "\n";
  const std::string version4 = replaced(kRinex3Header, "     3.04", "     4.00") + "> EPH S23 SBAS\n" + kS23;
  for (const std::string& text : {kRinex3Header + kS23, version2, version4}) {
    const gnss::NavigationData data = read(text);
    EXPECT_THAT(data.report.lines(), IsEmpty());
    EXPECT_FALSE(data.empty());
    ASSERT_EQ(data.sbas.size(), 1u);
    const gnss::SbasEphemeris& s = data.sbas.front();
    EXPECT_EQ(s.id, (gnss::SatelliteId{gnss::System::SBAS, 23}));
    EXPECT_EQ(s.toe, parse_time("2019-04-28T12:00:00 GPST"));
    EXPECT_EQ(s.transmission, parse_time("2019-04-28T12:00:15 GPST"));
    EXPECT_EQ(s.clock_bias_s, 9.313225746155e-09);
    EXPECT_EQ(s.clock_drift, -1.818989403546e-12);
    EXPECT_DOUBLE_EQ(s.position_m[0], 35944600.08);
    EXPECT_DOUBLE_EQ(s.velocity_mps[1], -2.1875);
    EXPECT_DOUBLE_EQ(s.acceleration_mps2[2], -6.25e-5);
    EXPECT_EQ(s.health, 0);
    EXPECT_EQ(s.accuracy_m, 4);
    EXPECT_EQ(s.iodn, 92);
  }
}

TEST(RinexNavigation, DamagedSbas) {
  for (const auto& [from, to, warning] : std::vector<std::array<std::string, 3>>{
           {" 2.204414000000e+04", "                   ", "position Y is missing"},
           {" 1.250000000000e-03", " 1.250000000000e+00", "velocity X 1.25 is outside"},
           {" 9.313225746155e-09", " 9.313225746155e-03", "clock bias aGf0"},
           {"S23", "S19", "there is no S19: SBAS numbers are 20 to 58"},
           {"S23", "S59", "there is no S59"}}) {
    const gnss::NavigationData data = read(replaced(kRinex3Sample + kS23, from, to));
    EXPECT_TRUE(data.sbas.empty());
    EXPECT_EQ(data.kepler.size(), 5u);
    EXPECT_THAT(data.report.lines(), ElementsAre(HasSubstr(warning)));
  }
}

TEST(RinexNavigation, HeaderIonosphereAndLeapSeconds) {
  const gnss::NavigationData data = read(kRinex3Sample);
  EXPECT_EQ(data.leap_seconds, 18);
  ASSERT_EQ(data.klobuchar.size(), 2u);
  EXPECT_THAT(data.klobuchar.at(gnss::System::GPS).alpha,
              ElementsAre(9.3132e-09, 1.4901e-08, -5.9605e-08, -1.1921e-07));
  EXPECT_THAT(data.klobuchar.at(gnss::System::GPS).beta, ElementsAre(88064, 49152, -131070, -327680));
  EXPECT_THAT(data.klobuchar.at(gnss::System::BeiDou).beta, ElementsAre(124930, -688130, 6881300, -7405600));
  EXPECT_EQ(data.galileo_nequick, (std::array<double, 3>{31.25, 0.125, 7.2327e-03}));
}

TEST(RinexNavigation, BeidouLeapSecondsAreTurnedToGps) {
  const std::string line = "     4     4   573     6                                    LEAP SECONDS\n";
  const std::string marked = "     4     4   573     6BDS                                 LEAP SECONDS\n";
  const std::string gps_line =
      "    18    18  1929     7                                    LEAP SECONDS        \n";
  EXPECT_EQ(read(replaced(kRinex3Sample, gps_line, marked)).leap_seconds, 18);
  const std::string beidou_file = replaced(kRinex3Header, "M: MIXED ", "C: BEIDOU") + kC21;
  EXPECT_EQ(read(replaced(beidou_file, gps_line, line)).leap_seconds, 18);
  EXPECT_EQ(read(beidou_file).leap_seconds, 18);
}

TEST(RinexNavigation, FormatVariantsReadTheSame) {
  const std::string plain = format_rinex_navigation(read(kRinex3Sample));
  std::string variant = kRinex3Sample;
  for (std::size_t at = 0; (at = variant.find('\n', at)) != std::string::npos; at += 2)
    variant.replace(at, 1, "\r\n");
  EXPECT_EQ(format_rinex_navigation(read(variant)), plain);

  variant = kRinex3Sample;
  const std::size_t body = variant.find("END OF HEADER") + 13;
  for (std::size_t i = body; i < variant.size(); ++i) {
    if (variant[i] == 'e') variant[i] = 'D';
  }
  EXPECT_EQ(format_rinex_navigation(read(variant)), plain);

  EXPECT_EQ(format_rinex_navigation(read(kRinex3Sample + "\n   \n")), plain);
  EXPECT_EQ(format_rinex_navigation(read(replaced(kRinex3Sample, "R07", "R 7"))), plain);
  // Invalid text in spare columns is ignored; Fortran omits the E of three-digit exponents.
  EXPECT_EQ(format_rinex_navigation(read(replaced(kRinex3Sample, "3.601800000000e+04 4.000000000000e+00",
                                                  "3.601800000000e+04 4.000000000000e+00 rubbish"))),
            plain);
  EXPECT_EQ(kepler(read(replaced(kRinex3Sample, " 3.410605131648e-13", " 0.499063314480-269")),
                   {gnss::System::GPS, 5})
                .af1,
            4.99063314480e-270);
}

TEST(RinexNavigation, BlankTrailingFields) {
  // No fit interval, unknown transmission time.
  const gnss::NavigationData data = read(
      replaced(kRinex3Sample, "     3.601800000000e+04 4.000000000000e+00\n", "     9.999000000000e+08\n"));
  EXPECT_THAT(data.report.lines(), IsEmpty());
  const gnss::KeplerEphemeris& e = kepler(data, {gnss::System::GPS, 5});
  EXPECT_EQ(e.fit_interval_h, 0);
  EXPECT_EQ(e.transmission, e.toe);
}

TEST(RinexNavigation, WeekRolloverIsJudgedByTheClockEpoch) {
  // Clock epoch late on Saturday, toe at the start of the next week, message sent before.
  std::string record = replaced(kG05, "2019 04 28 12 00 00", "2019 04 27 23 59 44");
  record = replaced(record, "4.320000000000e+04", "0.000000000000e+00");
  for (const char* sent : {"5.976000000000e+05", "-7.200000000000e+03"}) {
    for (const char* week :
         {"2.051000000000e+03", "2.050000000000e+03", "3.000000000000e+00"}) {  // 3 is 2051 mod 1024
      std::string text = replaced(record, "2.051000000000e+03", week);
      text = replaced(text, " 3.601800000000e+04", sent[0] == '-' ? sent : " " + std::string(sent));
      const gnss::NavigationData data = read(kRinex3Header + text);
      const gnss::KeplerEphemeris& e = kepler(data, {gnss::System::GPS, 5});
      EXPECT_EQ(e.toe, GpsTime::from_week(2051, 0)) << week;
      EXPECT_EQ(e.transmission, GpsTime::from_week(2050, 597600)) << sent;
    }
  }
}

TEST(RinexNavigation, BeidouWeekFromEitherOrigin) {
  for (const char* week : {"6.950000000000e+02", "2.051000000000e+03"}) {
    const gnss::NavigationData data = read(kRinex3Header + replaced(kC21, "6.950000000000e+02", week));
    EXPECT_EQ(kepler(data, {gnss::System::BeiDou, 21}).toe, GpsTime::from_week(2051, 43214));
  }
}

TEST(RinexNavigation, GlonassExtras) {
  const std::string fifth =
      "     1.830000000000e+02-2.793967723846e-09 3.000000000000e+00 0.000000000000e+00\n";
  EXPECT_EQ(read(kRinex3Header + kR07 + fifth).glonass.front().group_delay_difference_s, -2.793967723846e-09);
  // Unknown fields of RINEX 3.05.
  const std::string unknown = "                         .999999999999e+09 1.500000000000e+01\n";
  EXPECT_EQ(read(kRinex3Header + kR07 + unknown).glonass.front().group_delay_difference_s, 0);
  // A channel written as an unsigned byte.
  const gnss::NavigationData data =
      read(kRinex3Header + replaced(kR07, " 5.000000000000e+00", " 2.530000000000e+02"));
  EXPECT_EQ(data.glonass.front().channel, -3);
}

// RINEX 3.05, table A10, and ICD GLONASS 5.1, table 5.1: bit 2 is l(3) of GLONASS-M and K (status bits 7 and
// 8 01), bit 1 means that bit 0 is Cn, whose 1 is operable.
TEST(RinexNavigation, GlonassHealthFlags) {
  const auto healthy = [](int status, int flags, int bn = 0) {
    const std::string fifth = fmt::format("    {:19.12e}-2.793967723846e-09 3.000000000000e+00{:19.12e}\n",
                                          static_cast<double>(status), static_cast<double>(flags));
    std::string record = kR07;
    if (bn != 0) {
      const std::size_t end_of_x = record.find('\n', record.find('\n') + 1);
      record.replace(end_of_x - 19, 19, fmt::format("{:19.12e}", static_cast<double>(bn)));
    }
    return is_healthy(read(kRinex3Header + record + fifth).glonass.front());
  };
  constexpr int kM = 183, kFirst = 55;
  EXPECT_TRUE(healthy(kM, 0b000));
  EXPECT_TRUE(healthy(kM, 0b011));   // operable by the almanac, as in all files of today
  EXPECT_TRUE(healthy(kM, 0b001));   // Cn is not given
  EXPECT_FALSE(healthy(kM, 0b010));  // out of order by the almanac
  EXPECT_FALSE(healthy(kM, 0b100));
  EXPECT_FALSE(healthy(kM, 0b111));
  EXPECT_TRUE(healthy(kFirst, 0b111));  // l(3) does not exist on the first satellites
  EXPECT_FALSE(healthy(kM, 0b011, 1));
  // The standard's notation for "unknown".
  const std::string unknown = "                         .999999999999e+09 1.500000000000e+01\n";
  EXPECT_TRUE(is_healthy(read(kRinex3Header + kR07 + unknown).glonass.front()));
}

/// "R 23 of 23, S 0 of 5": satellites with a healthy record, and all.
std::string healthy_satellites(const gnss::NavigationData& data) {
  std::map<gnss::System, std::pair<std::set<gnss::SatelliteId>, std::set<gnss::SatelliteId>>> found;
  const auto count = [&](const auto& records) {
    for (const auto& e : records) {
      found[e.id.system].second.insert(e.id);
      if (is_healthy(e)) found[e.id.system].first.insert(e.id);
    }
  };
  count(data.kepler);
  count(data.glonass);
  count(data.sbas);
  std::string text;
  for (const auto& [system, sets] : found) {
    text += fmt::format("{}{} {} of {}", text.empty() ? "" : ", ", name(system), sets.first.size(),
                        sets.second.size());
  }
  return text;
}

// Counted by a separate script (columns cut by the standards' tables). Unhealthy are: G24 and G27 of 2012
// (63), E14 and E18 (HS of E1-B), of 2022 E10 (DVS) and E12 (no accuracy), of 2024 C56, C58 and C62 (SatH1),
// R02 and R10 (Bn), E18, and SBAS in test.
TEST(RinexNavigation, HealthySatellitesOfRealDays) {
  const std::pair<const char*, const char*> days[] = {
      {"orbits/brdc3050.12n", "GPS 30 of 32"},
      {"orbits/ESBC00DNK_R_20201770000_01D_MN.rnx.gz",
       "GPS 31 of 31, GLONASS 23 of 23, Galileo 22 of 24, BeiDou 29 of 29, QZSS 3 of 3, SBAS 0 of 5"},
      {"orbits/KMS300DNK_R_20221591000_01H_MN.rnx.gz",
       "GPS 21 of 21, GLONASS 10 of 10, Galileo 15 of 18, BeiDou 23 of 23, QZSS 1 of 1, SBAS 0 of 8"},
      {"rtk-nagoya-20240624/base.nav",
       "GPS 13 of 13, GLONASS 8 of 10, Galileo 13 of 14, BeiDou 29 of 32, QZSS 3 of 3"},
      {"berlin-potsdamer-platz/brdc1580.16g", "GLONASS 24 of 25"}};
  for (const auto& [file, counts] : days) {
    CANYON_SHARED_DATA(path, file);
    EXPECT_EQ(healthy_satellites(read_rinex_navigation(path)), counts) << file;
  }
}

TEST(RinexNavigation, Version2Gps) {
  const gnss::NavigationData data = read(test::kVersion2);
  EXPECT_THAT(data.report.lines(), IsEmpty());
  const gnss::KeplerEphemeris& e = kepler(data, {gnss::System::GPS, 5});
  EXPECT_EQ(e.toe, GpsTime::from_week(2051, 43200));
  EXPECT_EQ(e.toc, e.toe);
  EXPECT_EQ(e.af0, -0.123456789012e-03);
  EXPECT_EQ(e.iode, 96);
  EXPECT_EQ(e.iodc, 608);
  EXPECT_EQ(data.klobuchar.at(gnss::System::GPS).alpha[1], -0.7451e-08);
  EXPECT_EQ(data.klobuchar.at(gnss::System::GPS).beta[3], 327700);
  EXPECT_EQ(data.leap_seconds, 18);

  // Two-digit years: 80 to 99 are in the last century.
  const gnss::NavigationData old = read(replaced(replaced(test::kVersion2, " 5 19 04 28", " 5 99 04 25"),
                                                 "0.205100000000D+04", "0.100700000000D+04"));
  EXPECT_EQ(kepler(old, {gnss::System::GPS, 5}).toe, parse_time("1999-04-25T12:00:00 GPST"));
}

TEST(RinexNavigation, Version2Glonass) {
  const std::string text =
      "     2.11           GLONASS NAV DATA                        RINEX VERSION / TYPE\n"
      "                                                            END OF HEADER       \n"
      " 7 19 04 28 11 45  0.0 0.635590404272D-04-0.909494701773D-12 0.421800000000D+05\n"
      "    0.109089423828D+05 0.140780639648D+01-0.186264514923D-08 0.000000000000D+00\n"
      "   -0.288572607422D+04 0.279585552216D+01 0.000000000000D+00 0.500000000000D+01\n"
      "    0.228835395508D+05-0.316998481751D+00-0.279396772385D-08 0.100000000000D+01\n";
  const gnss::NavigationData data = read(text);
  ASSERT_EQ(data.glonass.size(), 1u);
  const gnss::GlonassEphemeris& r = data.glonass.front();
  EXPECT_EQ(r.id, (gnss::SatelliteId{gnss::System::GLONASS, 7}));
  EXPECT_EQ(r.toe, parse_time("2019-04-28T11:45:00Z"));
  EXPECT_EQ(r.transmission, r.toe - 120.0);
  EXPECT_DOUBLE_EQ(r.position_m[1], -2885726.07422);
}

TEST(RinexNavigation, Version4) {
  const std::string header =
      "     4.00           N: GNSS NAV DATA    M: MIXED            RINEX VERSION / TYPE\n"
      "    18                                                      LEAP SECONDS        \n"
      "                                                            END OF HEADER       \n";
  const std::string ion =
      "> ION G29 LNAV\n"
      "    2019 04 28 09 59 48 1.024454832077E-08 2.235174179077E-08-5.960464477539E-08\n"
      "    -1.192092895508E-07 9.625600000000E+04 1.310720000000E+05-6.553600000000E+04\n"
      "    -5.898240000000E+05 0.000000000000E+00\n";
  const std::string nequick =
      "> ION E12 IFNV\n"
      "    2019 04 28 09 59 48 1.372500000000E+02 5.507812500000E-01 3.753662109375E-03\n"
      "     0.000000000000E+00\n";
  const std::string bdgim =
      "> ION C20 CNVX\n"
      "    2019 04 28 10 00 00 2.025000000000E+01-2.500000000000E-01 9.625000000000E+00\n"
      "     1.000000000000E+00 1.000000000000E+00-7.500000000000E-01 1.000000000000E+00\n"
      "     5.000000000000E-01 5.000000000000E-01\n";
  const std::string sto =
      "> STO G26 LNAV\n"
      "    2019 04 28 19 56 48 GPUT                                  UTC(USNO)         \n"
      "     2.952840000000E+05 9.313225746155E-10 2.664535259100E-15 0.000000000000E+00\n";
  const std::string inav = replaced(kE11, "5.170000000000e+02", "                  ");
  const gnss::NavigationData data = read(
      header + "> EPH G05 LNAV\n" + kG05 + ion + "> EPH R07 FDMA\n" + kR07 + sto + "> EPH E11 FNAV\n" + inav +
      "> EPH C03 D2\n" + kC03 + nequick + bdgim + "> EPH J02 LNAV\n" + kJ02 + "> EPH G05 CNVX\n" + kG05);
  EXPECT_EQ(data.kepler.size(), 4u);
  EXPECT_EQ(data.glonass.size(), 1u);
  EXPECT_TRUE(is_galileo_fnav(kepler(data, {gnss::System::Galileo, 11})));
  EXPECT_EQ(data.klobuchar.at(gnss::System::GPS).alpha[3], -1.192092895508E-07);
  EXPECT_EQ(data.klobuchar.at(gnss::System::GPS).beta[3], -5.898240000000E+05);
  EXPECT_EQ(data.galileo_nequick->at(1), 5.507812500000E-01);
  EXPECT_THAT(data.report.lines(),
              testing::UnorderedElementsAre(HasSubstr("1 STO records that Canyon does not use, left out"),
                                            HasSubstr("1 ION records that Canyon does not use, left out"),
                                            HasSubstr("1 EPH records that Canyon does not use, left out")));
}

// Orbits of RINEX 4.00, tables A9 (CNAV), A10 (CNV2), A18 (CNV1) and A20 (CNV3): TGD in the sixth line's
// third field, corrections in the seventh and eighth; of CNV3 in the seventh line's last field; synthetic
// numbers. Delay of a signal: TGD - ISC (IS-GPS-200 30.3.3.3.1.1).
TEST(RinexNavigation, Version4TellsDelaysOfSignals) {
  const std::string header =
      "     4.00           N: GNSS NAV DATA    M: MIXED            RINEX VERSION / TYPE\n"
      "                                                            END OF HEADER       \n";
  const auto row = [](double a, double b, double c, double d) {
    return fmt::format("    {:19.12E}{:19.12E}{:19.12E}{:19.12E}\n", a, b, c, d);
  };
  std::string orbits;
  for (int i = 0; i < 5; ++i) orbits += row(1, 2, 3, 4);
  const std::string clock = " 2022 06 08 10 00 00 1.000000000000E-04 2.000000000000E-12 0.000000000000E+00\n";
  const std::string delays = row(0, 0, -8e-9, 0) + row(1e-9, -2e-9, 3e-9, 4e-9);
  const gnss::NavigationData data = read(
      header + "> EPH G05 LNAV\n" + kG05 + "> EPH G05 CNAV\nG05" + clock + orbits + delays + row(0, 0, 0, 0) +
      "> EPH G05 CNV2\nG05" + clock + orbits + delays + row(5e-9, 6e-9, 0, 0) + row(0, 0, 0, 0) +
      "> EPH C21 CNV1\nC21" + clock + orbits + row(0, 0, 0, 0) + row(7e-9, 0, 9e-9, 1e-8) + row(0, 0, 0, 0) +
      row(0, 0, 0, 0) + "> EPH C22 CNV3\nC22" + clock + orbits + row(0, 0, 0, 0) + row(7, 0, 0, -5e-9) +
      row(0, 0, 0, 0) + "> EPH G06 CNAV\nG06" + clock + orbits);
  EXPECT_EQ(data.kepler.size(), 1U);
  ASSERT_EQ(data.signal_delays.size(), 4U);
  using testing::DoubleNear;
  const gnss::SignalDelays &cnv1 = data.signal_delays[2], &cnav = data.signal_delays[0],
                           &cnv2 = data.signal_delays[1];
  const auto near = [](double s) { return DoubleNear(s, 1e-18); };
  const auto delays_of = [](const gnss::SignalDelays& message) {
    const auto begin = message.group_delay_s.begin();
    const auto signals = gnss::signals_of(message.id.system);
    const auto count = std::count_if(signals.begin(), signals.end(),
                                     [](const gnss::Signal& s) { return s.only_recorded.empty(); });
    return std::vector<double>(begin, begin + count);
  };
  constexpr double kNone = std::numeric_limits<double>::infinity();
  EXPECT_THAT(delays_of(cnav), ElementsAre(near(-9e-9), kNone, near(-6e-9), near(-12e-9)));
  EXPECT_THAT(delays_of(cnv2), ElementsAre(near(-9e-9), near(-14e-9), near(-6e-9), near(-12e-9)));
  EXPECT_THAT(delays_of(cnv1), ElementsAre(kNone, near(9e-9), kNone, near(1e-8), kNone, kNone));
  EXPECT_THAT(delays_of(data.signal_delays[3]), ElementsAre(kNone, kNone, kNone, kNone, kNone, near(-5e-9)));
  EXPECT_EQ(cnav.toc, parse_time("2022-06-08T10:00:00 GPST"));
  EXPECT_EQ(cnv1.toc, cnav.toc + 14.0);
  EXPECT_THAT(data.report.lines(), ElementsAre(HasSubstr("CNAV record of G06 has 6 lines instead of 9")));
}

TEST(RinexNavigation, Version4TagAndSatelliteMustAgree) {
  const std::string header =
      "     4.00           N: GNSS NAV DATA    M: MIXED            RINEX VERSION / TYPE\n"
      "                                                            END OF HEADER       \n";
  const gnss::NavigationData data = read(header + "> EPH G06 LNAV\n" + kG05 + kE11 + "> EPH J02 LNAV\n" +
                                         kJ02 + "> gibberish\n" + "> EPH C03 D2\n");
  EXPECT_EQ(data.kepler.size(), 1u);
  EXPECT_THAT(data.report.lines(),
              ElementsAre(AllOf(HasSubstr("sky.rnx:3:"), HasSubstr("different satellites")),
                          AllOf(HasSubstr("sky.rnx:12:"), HasSubstr("without its '>' line")),
                          AllOf(HasSubstr("sky.rnx:29:"), HasSubstr("not a record type")),
                          AllOf(HasSubstr("sky.rnx:30:"), HasSubstr("no lines"))));
}

// teqc's comments; the week's end as 604800; programs without the week.
TEST(RinexNavigation, CommentsAndOtherWaysOfTimes) {
  const std::string comment = "# another file                                              COMMENT\n";
  const std::size_t inside = kG05.find('\n') + 1;
  const gnss::NavigationData data =
      read(kRinex3Header + comment + kG05.substr(0, inside) + comment + kG05.substr(inside) + comment + kE11);
  EXPECT_EQ(data.kepler.size(), 2U);
  EXPECT_THAT(data.report.lines(), IsEmpty());
  std::string end = replaced(kG05, "2019 04 28 12 00 00", "2019 05 05 00 00 00");
  end = replaced(end, "4.320000000000e+04", "6.048000000000e+05");
  const gnss::NavigationData weeks =
      read(kRinex3Header + end + replaced(kE11, "2.051000000000e+03", "0.000000000000e+00"));
  ASSERT_EQ(weeks.kepler.size(), 2U);
  EXPECT_EQ(weeks.kepler[0].toe, parse_time("2019-05-05T00:00:00 GPST"));
}

TEST(RinexNavigation, ADamagedRecordIsLostAlone) {
  struct Case {
    const char *from, *to, *warning;
  };
  // Each damages the GPS record, which begins in line 9; all others remain valid.
  const Case cases[] = {
      {"4.106242470052e-09", "4.1062x2470052e-09",
       "'4.1062x2470052e-09' in line 2 of the record is not a number"},
      {"5.041313482914e-03", "1.041313482914e+00", "eccentricity 1.04131 is outside"},
      {"5.041313482914e-03", "               nan", "not a number"},
      {" 5.041313482914e-03", "-5.041313482914e-03", "eccentricity"},
      {"5.153679471970e+03", "5.153679471970e+02", "square root of the semi-major axis 515.368 is outside"},
      {"5.153679471970e+03", "                  ", "square root of the semi-major axis is missing"},
      {"4.320000000000e+04", "7.000000000000e+05", "toe 700000 is outside"},
      {"4.320000000000e+04", "4.320000000000e+05", "clock epoch and toe are 60.0 h apart"},
      {"4.320000000000e+04", "6.120000000000e+04", "clock epoch and toe are 5.0 h apart"},
      {"G05 2019 04 28", "G05 2019 14 28", "the epoch '2019 14 28"},
      {"G05 2019 04 28", "G05 2019 0a 28", "the epoch '2019 0a 28 12 00 00' is not a date"},
      {"G05 2019 04 28", "G05 1019 04 28", "the epoch '1019 04 28"},
      {"G05 2019", "G33 2019", "there is no G33"},
      {"G05 2019", "G00 2019", "'G00' is not a satellite"},
      {"G05 2019", "?05 2019", "'?05' is not a satellite"},
      {"     1.812353730202e-06 5.041313482914e-03 9.221956133842e-06 5.153679471970e+03\n", "",
       "7 lines instead of 8"},
      {"     1.812353730202e-06", "     1.8\n     1.812353730202e-06", "9 lines instead of 8"},
      {"9.600000000000e+01", "9.650000000000e+01", "issue of data 96.5 is not a whole number"},
      {"     4.320000000000e+04", "   -4.320000000000e+04", "line 4 of the record begins in its indentation"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.warning);
    const gnss::NavigationData data = read(replaced(kRinex3Sample, c.from, c.to));
    EXPECT_EQ(data.kepler.size(), 4u);
    EXPECT_EQ(data.glonass.size(), 1u);
    EXPECT_THAT(data.report.lines(), ElementsAre(AllOf(HasSubstr("sky.rnx:9: "), HasSubstr(c.warning))));
  }
}

TEST(RinexNavigation, DamagedGlonass) {
  for (const auto& [from, to, warning] : std::vector<std::array<std::string, 3>>{
           {" 1.090894238281e+04", " 4.090894238281e+04", "position X 40908.9 is outside -30000 to 30000"},
           {" 5.000000000000e+00", " 1.500000000000e+01", "frequency number 15"},
           {"R07", "R28", "there is no R28"}}) {
    const gnss::NavigationData data = read(replaced(kRinex3Sample, from, to));
    EXPECT_TRUE(data.glonass.empty());
    EXPECT_EQ(data.kepler.size(), 5u);
    EXPECT_THAT(data.report.lines(), ElementsAre(AllOf(HasSubstr("sky.rnx:17: "), HasSubstr(warning))));
  }
}

TEST(RinexNavigation, TruncatedAtTheEnd) {
  const gnss::NavigationData data = read(kRinex3Sample.substr(0, kRinex3Sample.size() - 200));
  EXPECT_EQ(data.kepler.size(), 4u);
  EXPECT_THAT(data.report.lines(), ElementsAre(HasSubstr("record of J02 has 5 lines instead of 8")));
}

TEST(RinexNavigation, OtherSystemsAreCountedOnce) {
  const std::string i01 = replaced(kG05, "G05", "I01");
  const gnss::NavigationData data = read(kRinex3Header + i01 + kG05 + i01 + i01);
  EXPECT_EQ(data.kepler.size(), 1u);
  EXPECT_THAT(
      data.report.lines(),
      ElementsAre(HasSubstr("sky.rnx: 3 records of NavIC, which Canyon does not simulate, left out")));
  EXPECT_THAT(error_of(kRinex3Header + i01 + i01),
              HasSubstr("has 2 records of NavIC and no ephemeris of GPS"));
}

TEST(RinexNavigation, ManyDamagesAreCounted) {
  std::string text = kRinex3Header + kG05;
  for (int i = 0; i < 50; ++i) text += replaced(kG05, "G05", "G99");
  const gnss::NavigationData data = read(text);
  EXPECT_THAT(data.report.lines(), ElementsAre(HasSubstr("(the first of 50); record left out")));
}

// 2.12: as 2.11's GPS, with the values of the system's own table.
TEST(RinexNavigation, Version2GalileoAndQzss) {
  const auto version2 = [](const std::string& record, const char* type) {
    std::string text =
        test::header_line(fmt::format("     2.12           {}", type), "RINEX VERSION / TYPE") +
        test::header_line("", "END OF HEADER");
    for (std::size_t at = 0, line = 0; at < record.size(); ++line) {
      const std::size_t end = record.find('\n', at);
      // "E11 2019 04 28 11 50 00" becomes "11 19  4 28 11 50  0.0", others lose a blank.
      text += line == 0 ? record.substr(1, 2) + " " + record.substr(6, 2) + " " + record.substr(9, 2) + " " +
                              record.substr(12, 2) + " " + record.substr(15, 2) + " " + record.substr(18, 2) +
                              " " + record.substr(21, 2) + ".0" + record.substr(23, end - 22)
                        : record.substr(at + 1, end - at);
      at = end + 1;
    }
    return text;
  };
  for (const auto& [record, type] : {std::pair(kE11, "E"), std::pair(kE11, "L"), std::pair(kJ02, "J")}) {
    const gnss::NavigationData old = read(version2(record, type));
    const gnss::NavigationData now = read(kRinex3Header + record);
    ASSERT_EQ(old.kepler.size(), 1U);
    EXPECT_THAT(old.report.lines(), IsEmpty());
    EXPECT_EQ(old.kepler[0].id, now.kepler[0].id);
    EXPECT_EQ(old.kepler[0].toe, now.kepler[0].toe);
    EXPECT_EQ(old.kepler[0].mean_anomaly, now.kepler[0].mean_anomaly);
    EXPECT_EQ(old.kepler[0].group_delay, now.kepler[0].group_delay);
    EXPECT_EQ(old.kepler[0].transmission, now.kepler[0].transmission);
  }
}

// As written by RTKLIB's convbin: 2.12 by its header, with version 3's records.
TEST(RinexNavigation, Version2WithRecordsOfVersion3) {
  for (const std::string& record : {kE11, kJ02}) {
    const gnss::NavigationData old =
        read(test::header_line("     2.12           N: GNSS NAV DATA    E: Galileo", "RINEX VERSION / TYPE") +
             test::header_line("", "END OF HEADER") + record);
    ASSERT_EQ(old.kepler.size(), 1U);
    EXPECT_THAT(old.report.lines(), IsEmpty());
    const gnss::KeplerEphemeris now = read(kRinex3Header + record).kepler[0];
    EXPECT_EQ(old.kepler[0].id, now.id);
    EXPECT_EQ(old.kepler[0].toe, now.toe);
    EXPECT_EQ(old.kepler[0].mean_anomaly, now.mean_anomaly);
  }
}

TEST(RinexNavigation, UnusableFilesAreErrors) {
  EXPECT_THAT(error_of(""), HasSubstr("is not a RINEX file"));
  EXPECT_THAT(error_of("<html>\n"), AllOf(HasSubstr("sky.rnx:1:"), HasSubstr("is not a RINEX file")));
  EXPECT_THAT(error_of(replaced(kRinex3Sample, "     3.04", "     5.00")),
              HasSubstr("version '5.00' is not supported"));
  EXPECT_THAT(error_of(replaced(kRinex3Sample, "N: GNSS NAV DATA", "OBSERVATION DATA")),
              HasSubstr("observation file"));
  EXPECT_THAT(error_of(kRinex3Header.substr(0, 300)), HasSubstr("no END OF HEADER"));
  EXPECT_THAT(error_of(kRinex3Header), HasSubstr("has no ephemeris"));
  EXPECT_THAT(error_of(kRinex3Header + replaced(kG05, "G05", "G99")),
              AllOf(HasSubstr("sky.rnx:9:"), HasSubstr("no usable ephemeris"), HasSubstr("G99")));
  EXPECT_THROW((void)read_rinex_navigation(std::filesystem::path("/nonexistent/sky.rnx")), InputError);
  EXPECT_THROW((void)read_rinex_navigation(std::vector<std::filesystem::path>{}), InputError);
}

TEST(RinexNavigation, GzipIsRead) {
  const test::TemporaryFolder folder;
  const std::string path = (folder / "sky.rnx.gz").string();
  gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, kRinex3Sample.data(), static_cast<unsigned>(kRinex3Sample.size()));
  gzclose(file);
  const gnss::NavigationData data = read_rinex_navigation(std::filesystem::path(path));
  EXPECT_EQ(data.kepler.size(), 5u);
  EXPECT_THAT(data.sources, ElementsAre("sky.rnx.gz"));
}

TEST(RinexNavigation, GzipThatEndsEarlyIsReadUpToThere) {
  const test::TemporaryFolder folder;
  const std::string path = (folder / "sky.rnx.gz").string();
  gzFile file = gzopen(path.c_str(), "wb0");  // stored without compression: cut where the plain file would be
  gzwrite(file, kRinex3Sample.data(), static_cast<unsigned>(kRinex3Sample.size()));
  gzclose(file);
  const std::size_t end_of_two = kRinex3Sample.find("E11");
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - (kRinex3Sample.size() - end_of_two));
  const gnss::NavigationData data = read_rinex_navigation(std::filesystem::path(path));
  EXPECT_EQ(data.kepler.size(), 1u);
  EXPECT_THAT(data.report.lines(),
              Contains(AllOf(HasSubstr("sky.rnx.gz:"), HasSubstr("the gzip data end early"))));
}

TEST(RinexNavigation, FilesAreMerged) {
  const test::TemporaryFolder folder;
  const auto write = [&folder](const char* name, const std::string& text) {
    std::ofstream(folder / name) << text;
    return folder / name;
  };
  const std::string later =
      replaced(replaced(replaced(kG05, "12 00 00", "14 00 00"), "4.320000000000e+04", "5.040000000000e+04"),
               "9.600000000000e+01", "9.700000000000e+01");
  const std::string sick = replaced(kG05, " 2.800000000000e+00 0.0", " 2.800000000000e+00 6.0");
  const auto a = write("a.rnx", kRinex3Header + later + kG05 + kG05);
  const auto b =
      write("b.rnx", replaced(kRinex3Header, "8.8064e+04", "9.9999e+04") + kG05 + kE11 + kR07 + sick);
  const auto c = write("c.rnx", kRinex3Header + kR07 + "G99 x\n");
  const gnss::NavigationData data = read_rinex_navigation({a, b, c});
  EXPECT_THAT(data.sources, ElementsAre("a.rnx", "b.rnx", "c.rnx"));
  ASSERT_EQ(data.glonass.size(), 1u);
  EXPECT_EQ(data.glonass[0].source, 1);
  // Duplicates are removed, but not a record that differs by its health; ordered by satellite and toe.
  ASSERT_EQ(data.kepler.size(), 4u);
  EXPECT_EQ(data.kepler[0].iode, 96);
  EXPECT_EQ(data.kepler[0].source, 0);
  EXPECT_EQ(data.kepler[1].health, 6);
  EXPECT_EQ(data.kepler[1].source, 1);
  EXPECT_EQ(data.kepler[2].iode, 97);
  EXPECT_EQ(data.kepler[3].id.system, gnss::System::Galileo);
  EXPECT_EQ(data.klobuchar.at(gnss::System::GPS).beta[0], 88064);  // the last file's
  EXPECT_THAT(data.report.lines(), ElementsAre(HasSubstr("c.rnx:13:")));
}

TEST(RinexNavigation, RealDayIsReadWhole) {
  CANYON_SHARED_DATA(path, "orbits/ESBC00DNK_R_20201770000_01D_MN.rnx.gz");
  const gnss::NavigationData data = read_rinex_navigation(path);
  std::map<gnss::System, int> count;
  for (const gnss::KeplerEphemeris& e : data.kepler) ++count[e.id.system];
  // zcat ESBC*.gz | sed '1,/END OF HEADER/d' | cut -c1 | sort | uniq -c
  EXPECT_EQ(count[gnss::System::GPS], 257);
  EXPECT_EQ(count[gnss::System::Galileo], 1602);
  EXPECT_EQ(count[gnss::System::BeiDou], 357);
  EXPECT_EQ(count[gnss::System::QZSS], 15);
  EXPECT_EQ(data.glonass.size(), 510u);
  EXPECT_EQ(data.sbas.size(), 2130u);
  EXPECT_THAT(data.report.lines(), IsEmpty());
}

TEST(RinexNavigation, RealRinex4) {
  CANYON_SHARED_DATA(path, "orbits/KMS300DNK_R_20221591000_01H_MN.rnx.gz");
  const gnss::NavigationData data = read_rinex_navigation(path);
  std::map<gnss::System, int> count;
  for (const gnss::KeplerEphemeris& e : data.kepler) ++count[e.id.system];
  // zcat KMS300*.gz | grep '^> EPH' | cut -c3-7,10-15 | sort | uniq -c
  EXPECT_EQ(count[gnss::System::GPS], 30);
  EXPECT_EQ(count[gnss::System::Galileo], 108);
  EXPECT_EQ(count[gnss::System::BeiDou], 36);
  EXPECT_EQ(count[gnss::System::QZSS], 1);
  EXPECT_EQ(data.glonass.size(), 24u);
  EXPECT_EQ(data.sbas.size(), 158u);
  EXPECT_EQ(data.klobuchar.size(), 2u);  // ION of G29 LNAV and of BeiDou D1D2
  EXPECT_TRUE(data.galileo_nequick.has_value());
}

}  // namespace
}  // namespace canyon::rinex
