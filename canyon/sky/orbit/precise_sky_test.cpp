#include "canyon/sky/orbit/precise_sky.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/text.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "tests/support/case_file.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::orbit {
namespace {

using geodesy::GpsTime;
using geodesy::kSpeedOfLight;
using geodesy::parse_time;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::StartsWith;

constexpr const char* kPrecise = "orbits/GRG0MGXFIN_20201770000_01D_15M_ORB.SP3.gz";

// A synthetic file: a circular Kepler orbit of GPS's size about a rotating Earth, closed form.
constexpr double kRadius = 26'560e3;
const double kRate = std::sqrt(3.986004418e14 / (kRadius * kRadius * kRadius));
const GpsTime kFirst = geodesy::gps_from_calendar({2024, 2, 29, 0, 0, 0, 0});

Eigen::Vector3d circle(double dt) {
  const double u = kRate * dt;
  const double i = geodesy::radians(55);
  const Eigen::Vector3d p(std::cos(u), std::sin(u) * std::cos(i), std::sin(u) * std::sin(i));
  return rotate_earth(kRadius * p, dt);
}

struct MadeUp {
  std::string time_system = "GPS";
  int records = 40;
  std::map<int, std::string> clock;  ///< by record, instead of the line
  std::map<int, bool> bad_position;
  std::map<int, bool> missing;
  std::map<int, int> minutes;  ///< as in the epoch line
  std::map<int, int> by_time;  ///< minutes of the position
  std::string satellite = "G07";
  int decimals = 6;  ///< of coordinates

  [[nodiscard]] std::string text() const {
    std::string text = "#dP2024  2 29  0  0  0.00000000      40 ORBIT IGS20 FIT  XXX\n";
    text += "## 2303 345600.00000000   900.00000000 60369 0.0000000000000\n";
    text += "+    1   " + satellite + "\n++         2\n";
    text += fmt::format("%c M  cc {} ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc\n", time_system);
    text += "%c cc cc ccc ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc\n/* comment\n";
    for (int k = 0; k < records; ++k) {
      const auto minute = minutes.find(k);
      const geodesy::CalendarTime c =
          geodesy::calendar_from_gps(kFirst + 60.0 * (minute == minutes.end() ? 15 * k : minute->second));
      text +=
          fmt::format("*  {:4} {:2} {:2} {:2} {:2}  0.00000000\n", c.year, c.month, c.day, c.hour, c.minute);
      if (missing.count(k) != 0) continue;
      const auto value = [k](const auto& of, auto otherwise) {
        const auto at = of.find(k);
        return at == of.end() ? otherwise : at->second;
      };
      Eigen::Vector3d p = circle(60.0 * value(by_time, 15 * k)) / 1e3;
      if (bad_position.count(k) != 0) p.setZero();
      const auto code_clock = clock.find(k);
      text += fmt::format(
          "P{}{:14.{}f}{:14.{}f}{:14.{}f}{}\n", satellite, p.x(), decimals, p.y(), decimals, p.z(), decimals,
          code_clock != clock.end() ? code_clock->second : fmt::format("{:14.6f}", 100 + 0.9 * k));
      text += fmt::format("EP  55   55   55     222  1234567\nV{}{:14.6f}{:14.6f}{:14.6f}{:14.6f}\n",
                          satellite, 1.0, 2.0, 3.0, 4.0);
    }
    return text + "EOF\n";
  }
  [[nodiscard]] PreciseSky sky() const { return PreciseSky(TextFile::from_string(text(), "made-up.sp3")); }
};

const gnss::SatelliteId kG07{gnss::System::GPS, 7};

std::string message(const std::string& text) {
  return test::refusal([&] { const PreciseSky sky(TextFile::from_string(text, "made-up.sp3")); });
}

std::vector<std::string> warnings(const std::string& text) {
  return PreciseSky(TextFile::from_string(text, "made-up.sp3")).report().lines();
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(PreciseSky, ReproducesAClosedFormOrbit) {
  const PreciseSky sky = MadeUp().sky();
  EXPECT_EQ(sky.satellites(), std::vector<gnss::SatelliteId>{kG07});
  EXPECT_EQ(sky.span().first, kFirst);
  EXPECT_EQ(sky.span().second, kFirst + 39 * 900.0);
  for (double dt = 5 * 900.0; dt <= 34 * 900.0; dt += 123.4) {
    const auto s = sky.state(kG07, kFirst + dt);
    ASSERT_TRUE(s);
    // Records are rounded to half a millimetre.
    EXPECT_LT((s->position_m - circle(dt)).norm(), 2e-3);
    const Eigen::Vector3d velocity = (circle(dt + 0.5) - circle(dt - 0.5));
    EXPECT_LT((s->velocity_mps - velocity).norm(), 1e-4);
    // Circular: no relativity; clock 100 us + 0.9 us each 900 s.
    EXPECT_NEAR(s->clock_bias_s, 100e-6 + 1e-9 * dt, 1e-13);
    EXPECT_NEAR(s->clock_drift, 1e-9, 1e-15);
    EXPECT_DOUBLE_EQ(s->carrier_frequency_hz, 1575.42e6);
  }
  // One-sided near the ends.
  for (double dt : {0.0, 100.0, 450.0, 38.5 * 900, 39.0 * 900}) {
    const auto s = sky.state(kG07, kFirst + dt);
    ASSERT_TRUE(s);
    EXPECT_LT((s->position_m - circle(dt)).norm(), 0.1);
  }
}

TEST(PreciseSky, DoesNotAnswerBeyondItsSpan) {
  const PreciseSky sky = MadeUp().sky();
  EXPECT_FALSE(sky.state(kG07, kFirst - 1e-9));
  EXPECT_FALSE(sky.state(kG07, kFirst + (39 * 900.0 + 1e-9)));
  EXPECT_THAT(sky.source(kG07, kFirst - 1.0), HasSubstr("no records around"));
  EXPECT_FALSE(sky.state({gnss::System::GPS, 8}, kFirst + 3600.0));
  EXPECT_THAT(sky.source({gnss::System::GPS, 8}, kFirst), HasSubstr("G08 is not in the file"));
  EXPECT_EQ(sky.source(kG07, kFirst + 1000.0), "made-up.sp3, record 2024-02-29T00:15:00 GPST");
}

TEST(PreciseSky, DoesNotAnswerNextToBadRecords) {
  MadeUp file;
  file.clock[20] = " 999999.999999";
  file.bad_position[5] = true;
  const PreciseSky sky = file.sky();
  EXPECT_FALSE(sky.state(kG07, kFirst + 20 * 900.0));
  EXPECT_FALSE(sky.state(kG07, kFirst + 19.1 * 900));
  EXPECT_TRUE(sky.state(kG07, kFirst + 19 * 900.0));
  EXPECT_TRUE(sky.state(kG07, kFirst + 21 * 900.0));
  EXPECT_THAT(sky.source(kG07, kFirst + 19.1 * 900), HasSubstr("clock marked as bad"));
  // Five good records before the bad position are too few for a polynomial, which does not extend across it.
  EXPECT_FALSE(sky.state(kG07, kFirst + 4.5 * 900));
  EXPECT_THAT(sky.source(kG07, kFirst + 4.5 * 900), HasSubstr("position marked as bad"));
  EXPECT_FALSE(sky.state(kG07, kFirst + 2.5 * 900));
  EXPECT_THAT(sky.source(kG07, kFirst + 2.5 * 900), HasSubstr("fewer than 11 records"));
  EXPECT_LT((sky.state(kG07, kFirst + 6.5 * 900)->position_m - circle(6.5 * 900)).norm(), 0.1);
}

// SP3-c and -d: column 75 E, a clock jump, and column 79 M, a maneuver, each since the preceding record.
TEST(PreciseSky, DoesNotAnswerAcrossManeuversAndJumpsOfClocks) {
  MadeUp file;
  const auto clock = [](int k, double jump_us) { return fmt::format("{:14.6f}", 100 + 0.9 * k + jump_us); };
  for (int k = 15; k < 40; ++k) file.clock[k] = clock(k, 500);
  file.clock[15] += std::string(14, ' ') + "E";
  file.clock[28] += std::string(18, ' ') + "M";
  const PreciseSky sky = file.sky();
  EXPECT_FALSE(sky.state(kG07, kFirst + 14.5 * 900));
  EXPECT_THAT(sky.source(kG07, kFirst + 14.5 * 900), HasSubstr("a jump of its clock"));
  EXPECT_NEAR(sky.state(kG07, kFirst + 14 * 900.0)->clock_drift, 1e-9, 1e-15);
  EXPECT_NEAR(sky.state(kG07, kFirst + 15 * 900.0)->clock_bias_s, 613.5e-6, 1e-12);
  EXPECT_FALSE(sky.state(kG07, kFirst + 27.5 * 900));
  EXPECT_THAT(sky.source(kG07, kFirst + 27.5 * 900), HasSubstr("a gap or a maneuver"));
  // Polynomials end on either side of it.
  EXPECT_LT((sky.state(kG07, kFirst + 26.5 * 900)->position_m - circle(26.5 * 900)).norm(), 0.1);
  EXPECT_LT((sky.state(kG07, kFirst + 28.5 * 900)->position_m - circle(28.5 * 900)).norm(), 0.1);
}

TEST(PreciseSky, BridgesOneMissingRecordButNotTwo) {
  MadeUp file;
  file.missing[12] = true;
  file.missing[24] = file.missing[25] = true;
  const PreciseSky sky = file.sky();
  const auto s = sky.state(kG07, kFirst + 12 * 900.0);
  ASSERT_TRUE(s);
  EXPECT_LT((s->position_m - circle(12 * 900.0)).norm(), 5e-3);
  EXPECT_FALSE(sky.state(kG07, kFirst + 24.5 * 900));
  EXPECT_THAT(sky.source(kG07, kFirst + 24.5 * 900), HasSubstr("gap"));
}

TEST(PreciseSky, RefusesAxesThatDoNotTurnWithTheEarth) {
  EXPECT_THAT(message(replaced(MadeUp().text(), "ORBIT IGS20", "ORBIT J2000")),
              HasSubstr("its coordinates are in J2000, which does not rotate with the Earth"));
}

// An epoch out of order, and a repeated one, are the only losses.
TEST(PreciseSky, LeavesOutEpochsThatDoNotFollowTheOneBefore) {
  for (const int minutes : {-15, 15 * 19}) {
    MadeUp file;
    file.minutes[20] = minutes;
    const PreciseSky sky = file.sky();
    EXPECT_THAT(sky.report().lines(),
                IsSupersetOf({AllOf(StartsWith("made-up.sp3:88: epoch"), HasSubstr("does not follow"))}));
    EXPECT_EQ(sky.span(), std::pair(kFirst, kFirst + 39 * 900.0));
    const auto s = sky.state(kG07, kFirst + 20 * 900.0);
    ASSERT_TRUE(s);
    EXPECT_LT((s->position_m - circle(20 * 900.0)).norm(), 0.02);
  }
}

TEST(PreciseSky, SaysWhatTheHeaderSaysOtherwise) {
  const auto warnings = [](const std::string& text) {
    return PreciseSky(TextFile::from_string(text, "made-up.sp3")).report().lines();
  };
  const std::string good = MadeUp().text();
  EXPECT_THAT(
      warnings(replaced(good, "     40 ORBIT", "     96 ORBIT")),
      ::testing::ElementsAre(StartsWith("made-up.sp3:1: the header declares 96 epochs, but 40 were read")));
  // Two days joined by cat.
  MadeUp second;
  for (int k = 0; k < 40; ++k) second.minutes[k] = second.by_time[k] = 15 * (40 + k);
  const PreciseSky both(TextFile::from_string(good + second.text(), "made-up.sp3"));
  EXPECT_EQ(both.span().second, kFirst + 79 * 900.0);
}

TEST(PreciseSky, RefusesFilesWithoutClocks) {
  // Blank and asterisks mean that the writer had no clock; a file without any clock is rejected.
  MadeUp none;
  none.clock[20] = std::string(14, '*');
  none.clock[21] = "";
  EXPECT_FALSE(none.sky().state(kG07, kFirst + 20.5 * 900));
  EXPECT_TRUE(none.sky().state(kG07, kFirst + 22.5 * 900));
  for (int k = 0; k < 40; ++k) none.clock[k] = " 999999.999999";
  EXPECT_THAT(message(none.text()), HasSubstr("no satellite has a clock"));
}

// Zeros mean that the writer had no position.
TEST(PreciseSky, SaysWhichSatellitesHaveNoPosition) {
  std::string text = MadeUp().text();
  const std::string zero = "PG08      0.000000      0.000000      0.000000    100.000000\n";
  for (std::size_t at = text.find("\nPG07"); at != std::string::npos;
       at = text.find("\nPG07", at + zero.size() + 2))
    text.insert(at + 1, zero);
  const PreciseSky sky(TextFile::from_string(text, "made-up.sp3"));
  EXPECT_THAT(sky.report().lines(),
              ::testing::Contains(HasSubstr("no position of G08; these satellites are left out")));
  EXPECT_TRUE(sky.state(kG07, kFirst + 10 * 900));
}

TEST(PreciseSky, LinesThatLostTheirFirstCharacterAreSaid) {
  const std::string text = MadeUp().text();
  const auto warnings_without = [&](std::string_view mark) {
    std::string changed = text;
    std::size_t at = 0;
    for (int k = 0; k < 10; ++k) at = changed.find(mark, at + 1);
    changed.erase(at + 1, 1);
    return PreciseSky(TextFile::from_string(changed, "made-up.sp3")).report().lines();
  };
  EXPECT_THAT(warnings_without("\nPG07"),
              ::testing::Contains(HasSubstr("line of a kind not defined in SP3")));
  EXPECT_THAT(warnings_without("\n*"), ::testing::Contains(HasSubstr("line without a mark")));
}

// A change of velocity of 1 m/s: the orbit after it is different.
// Missing digits and line ends, at a position where no neighbour reveals it.
TEST(PreciseSky, LinesThatLostACharacterElsewhereAreSaid) {
  const std::string good = MadeUp().text();
  const auto without = [&](std::size_t at) {
    std::string text = good;
    text.erase(at, 1);
    return PreciseSky(TextFile::from_string(text, "made-up.sp3")).report().lines();
  };
  const std::size_t epoch = good.find("\n*") + 1, position = good.find("\nP", epoch) + 1;
  const std::size_t end = good.find('\n', position);
  EXPECT_THAT(without(position - 1), Contains(HasSubstr("is not an epoch")));
  EXPECT_THAT(without(position), Contains(HasSubstr("line of a kind not defined in SP3")));
  EXPECT_THAT(without(end), Contains(HasSubstr("line of more than 80 columns")));
  EXPECT_THAT(without(end - 1), Contains(HasSubstr("lost or gained a character")));
  EXPECT_THAT(without(position + 4 + 13), Contains(HasSubstr("lost or gained a character")));
}

// SP3-c has fields of 14 columns; the writer chooses the number of decimals.
TEST(PreciseSky, DecimalsOfCoordinatesAndClocksDiffer) {
  MadeUp file;
  const GpsTime noon = kFirst + 20.5 * 900;
  const auto six = file.sky().state(kG07, noon);
  for (const int decimals : {3, 5, 7}) {
    file.decimals = decimals;
    const PreciseSky sky = file.sky();
    EXPECT_THAT(sky.report().lines(), ElementsAre());
    const auto state = sky.state(kG07, noon);
    ASSERT_TRUE(state && six);
    EXPECT_LT((state->position_m - six->position_m).norm(), 1.1 * std::pow(10, 3 - std::min(decimals, 6)))
        << decimals;
  }
}

TEST(PreciseSky, NoDigitIsLostOrAddedWithoutAWord) {
  for (const int decimals : {6, 7}) {
    MadeUp file;
    file.decimals = decimals;
    const std::string good = file.text();
    const std::size_t position = good.find("\nP", good.find("\n*  2024  2 29  3")) + 1;
    for (std::size_t at = position + 4; at < position + 60; ++at) {
      if (good[at] == ' ') continue;
      std::string lost = good, added = good;
      EXPECT_EQ(warnings(lost.erase(at, 1)).size(), 1U) << decimals << lost.substr(position, 61);
      EXPECT_EQ(warnings(added.insert(at, "1")).size(), 1U) << decimals << added.substr(position, 61);
    }
  }
}

TEST(PreciseSky, ReadsEveryTimeSystem) {
  const GpsTime noon = geodesy::gps_from_calendar({2024, 2, 29, 0, 0, 0, 0});
  const std::map<std::string, double> gpst_minus{{"GPS", 0},  {"GAL", 0},   {"QZS", 0},  {"IRN", 0},
                                                 {"BDT", 14}, {"TAI", -19}, {"UTC", 18}, {"GLO", 18}};
  for (const auto& [system, offset] : gpst_minus) {
    MadeUp file;
    file.time_system = system;
    EXPECT_EQ(file.sky().span().first, noon + offset) << system;
  }
  MadeUp file;
  file.time_system = "XYZ";
  EXPECT_THAT(message(file.text()), StartsWith("made-up.sp3:5: time system 'XYZ' is not known"));
}

TEST(PreciseSky, NamesFileAndLineOfBadInput) {
  const std::string good = MadeUp().text();
  EXPECT_THAT(message(""), HasSubstr("is not an SP3 file"));
  EXPECT_THAT(message("RINEX\n"), StartsWith("made-up.sp3:1: is not an SP3 file"));
  EXPECT_THAT(message(replaced(good, "#dP", "#aP")), StartsWith("made-up.sp3:1: SP3-a is not supported"));
  EXPECT_THAT(warnings(good.substr(0, good.size() - 4)), ElementsAre(HasSubstr("ends without the line EOF")));
  EXPECT_THAT(warnings(good.substr(0, good.size() / 2)),
              IsSupersetOf({HasSubstr("ends without the line EOF"), HasSubstr("declares 40 epochs")}));
  EXPECT_THAT(warnings(replaced(good, "*  2024  2 29  0  0", "*  2024  2 30  0  0")),
              Contains(HasSubstr("made-up.sp3:8: '*  2024  2 30  0  0  0.00000000' is not an epoch")));
  EXPECT_THAT(warnings(replaced(good, "*  2024  2 29  0 15", "*  2024  2 29  0 x5")),
              Contains(StartsWith("made-up.sp3:12: '*  2024  2 29  0 x5")));
  EXPECT_THAT(warnings(replaced(good, " 26560.000000", " 2656O.000000")),
              Contains(StartsWith("made-up.sp3:9: coordinate '2656O.000000' is not a number")));
  EXPECT_THAT(warnings(replaced(good, "PG07", "PG7x")),
              Contains(StartsWith("made-up.sp3:9: 'G7x' is not a satellite")));
  EXPECT_THAT(warnings(replaced(good, "*  2024  2 29  0  0  0.00000000\n", "")),
              Contains(StartsWith("made-up.sp3:8: a position before the first epoch")));
  EXPECT_THAT(message(replaced(good, "PG07", "PS07")), "");
  MadeUp sbas;
  sbas.satellite = "S07";
  EXPECT_THAT(message(sbas.text()), HasSubstr("no satellite of the chosen systems"));
  MadeUp none;
  none.records = 0;
  EXPECT_THAT(message(none.text()), HasSubstr("has no epoch"));
  for (std::size_t cut = 0; cut < good.size(); cut += 97) (void)message(good.substr(0, cut));
}

// Two synthetic days of one circular orbit: the states from one file in the evening equal those from two, and
// over midnight the orbit keeps its radius (the synthetic one within 1.2 km).
TEST(PreciseSky, FilesOfTwoDaysAreOne) {
  const std::filesystem::path day1 = test::case_file("sp3-two-days/day1.sp3");
  const std::filesystem::path day2 = test::case_file("sp3-two-days/day2.sp3");
  const PreciseSky one(day1);
  for (const auto& paths : {std::vector{day1, day2}, std::vector{day2, day1, day1}}) {
    const PreciseSky two(paths);
    EXPECT_EQ(two.satellites(), one.satellites());
    const gnss::SatelliteId id = one.satellites().front();
    const GpsTime evening = parse_time("2024-05-01T20:07:00 GPST");
    ASSERT_TRUE(one.state(id, evening) && two.state(id, evening));
    EXPECT_LT((one.state(id, evening)->position_m - two.state(id, evening)->position_m).norm(), 0.01);
    const GpsTime midnight = parse_time("2024-05-01T23:52:30 GPST");
    EXPECT_FALSE(one.state(id, midnight));
    ASSERT_TRUE(two.state(id, midnight));
    EXPECT_NEAR(two.state(id, midnight)->position_m.norm(), two.state(id, evening)->position_m.norm(), 2000);
  }
}

TEST(PreciseSky, TakesTheChosenSystemsOnly) {
  CANYON_SHARED_DATA(path, kPrecise);
  const PreciseSky all(path);
  EXPECT_EQ(all.satellites().size(), 75U);  // "+   75" in the header
  const PreciseSky galileo(path, {gnss::System::Galileo});
  for (const gnss::SatelliteId id : galileo.satellites()) EXPECT_EQ(id.system, gnss::System::Galileo);
  EXPECT_EQ(galileo.satellites().size(), 24U);
  // R03 has frequency channel 5: 1602 + 5 * 0.5625 MHz.
  EXPECT_DOUBLE_EQ(
      all.state({gnss::System::GLONASS, 3}, parse_time("2020-06-25T12:00:00 GPST"))->carrier_frequency_hz,
      1602e6 + 5 * 562.5e3);
}

/// The text of a file without every second epoch.
std::string thinned(TextFile file) {
  std::string text;
  int epoch = -1;
  while (const auto line = file.next_line()) {
    if (!line->empty() && line->front() == '*') ++epoch;
    const bool record = !line->empty() && (line->front() == '*' || line->front() == 'P');
    if (record && epoch % 2 == 1) continue;
    text.append(*line).append("\n");
  }
  return text;
}

TEST(PreciseSky, GivesBackLeftOutRecordsWithin5cm) {
  CANYON_SHARED_DATA(path, kPrecise);
  const PreciseSky whole(path);
  const PreciseSky half(TextFile::from_string(thinned(TextFile(path)), "half.sp3"));
  // Five records of the thinned file (2.5 h) from the ends the polynomial is centred.
  double worst = 0;
  std::string where;
  std::map<gnss::System, double> worst_of;
  int compared = 0;
  double worst_at_ends = 0;
  for (int k = 1; k < 96 - 1; k += 2) {
    const GpsTime t = whole.span().first + 900.0 * k;
    for (const gnss::SatelliteId id : whole.satellites()) {
      const auto a = whole.state(id, t);
      const auto b = half.state(id, t);
      if (!a || !b) continue;
      ++compared;
      const double error = (a->position_m - b->position_m).norm();
      if (k < 11 || k > 96 - 12) {
        worst_at_ends = std::max(worst_at_ends, error);
        continue;
      }
      worst_of[id.system] = std::max(worst_of[id.system], error);
      EXPECT_LT((a->velocity_mps - b->velocity_mps).norm(), 1e-3) << to_string(id);
      if (error > worst) {
        worst = error;
        where = to_string(id) + " " + geodesy::format_gpst(t, 0);
      }
    }
  }
  for (const auto& [system, error] : worst_of) {
    RecordProperty(std::string(name(system)) + "_max_m", std::to_string(error));
  }
  RecordProperty("ends_max_m", std::to_string(worst_at_ends));
  EXPECT_LT(worst, 0.05) << where;  // observed 0.011
  EXPECT_LT(worst_at_ends, 0.6);    // observed 0.48
  EXPECT_GT(compared, 2000);
}

TEST(PreciseSky, BroadcastClocksAndOrbitsAgreeWithinMetres) {
  CANYON_SHARED_DATA(precise_path, kPrecise);
  CANYON_SHARED_DATA(broadcast_path, "orbits/ESBC00DNK_R_20201770000_01D_MN.rnx.gz");
  const PreciseSky precise(precise_path);
  const BroadcastSky broadcast(rinex::read_rinex_navigation(broadcast_path));
  std::map<gnss::System, std::vector<double>> orbit;
  std::map<gnss::System, std::vector<double>> clock_rate;
  for (int minute = 300; minute < 1200; minute += 7) {
    const GpsTime t = precise.span().first + 60.0 * minute;
    for (const gnss::SatelliteId id : precise.satellites()) {
      const auto p = precise.state(id, t);
      const auto b = broadcast.state(id, t);
      if (!p || !b) continue;
      orbit[id.system].push_back((p->position_m - b->position_m).norm());
      EXPECT_LT((p->velocity_mps - b->velocity_mps).norm(), 0.05) << to_string(id);
      // The two clocks have different origins, but the eccentric satellites' relativity (up to 40 ns, 6e-12
      // s/s) would affect the rate.
      clock_rate[id.system].push_back(std::abs(p->clock_drift - b->clock_drift));
    }
  }
  ASSERT_EQ(orbit.size(), 3U);
  for (auto& [system, errors] : orbit) {
    ASSERT_GT(errors.size(), 500U);
    std::nth_element(errors.begin(), errors.begin() + static_cast<long>(errors.size() / 2), errors.end());
    EXPECT_LT(errors[errors.size() / 2], system == gnss::System::GLONASS ? 6 : 3) << name(system);
    RecordProperty(std::string(name(system)) + "_median_m", std::to_string(errors[errors.size() / 2]));
    std::vector<double>& rates = clock_rate[system];
    std::nth_element(rates.begin(), rates.begin() + static_cast<long>(rates.size() / 2), rates.end());
    EXPECT_LT(rates[rates.size() / 2], 2e-12) << name(system);
  }
}

}  // namespace
}  // namespace canyon::orbit
