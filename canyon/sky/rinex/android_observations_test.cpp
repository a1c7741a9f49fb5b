#include "canyon/sky/rinex/observation_reader.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/sky/rinex/android_log.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::rinex {
namespace {

using geodesy::GpsTime;
using geodesy::kSpeedOfLight;
using gnss::System;
using test::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kTravel_ns = 75'000'000;
/// A Tuesday of 2024, 11:00:00 GPST.
constexpr std::int64_t kNow_ns = 2312 * GpsTime::kNanosecondsPerWeek + 212'400 * kSecond_ns;
constexpr std::int64_t kUptime_ns = 5'000 * kSecond_ns;

/// The columns of a line, in the newest app's order or another.
using Line = std::map<std::string, std::string>;

/// GPS time of week minus the travel time, code and time of week decoded.
Line gps_line(int svid = 5, std::int64_t after_ns = 0) {
  return {{"TimeNanos", std::to_string(kUptime_ns + after_ns)},
          {"FullBiasNanos", std::to_string(kUptime_ns - kNow_ns)},
          {"BiasNanos", "0.0"},
          {"HardwareClockDiscontinuityCount", "3"},
          {"Svid", std::to_string(svid)},
          {"TimeOffsetNanos", "0.0"},
          {"State", "16399"},
          {"ReceivedSvTimeNanos",
           std::to_string((kNow_ns + after_ns) % GpsTime::kNanosecondsPerWeek - kTravel_ns)},
          {"ReceivedSvTimeUncertaintyNanos", "12"},
          {"Cn0DbHz", "41.5"},
          {"BasebandCn0DbHz", "37.5"},
          {"PseudorangeRateMetersPerSecond", "0.0"},
          {"AccumulatedDeltaRangeState", "0"},
          {"CarrierFrequencyHz", "1575420030"},
          {"MultipathIndicator", "0"},
          {"ConstellationType", "1"},
          {"CodeType", "C"}};
}

/// A line of another constellation, with this time of its satellite.
Line line_of(int constellation, int svid, std::int64_t state, std::int64_t sent_ns, const char* carrier_hz,
             const char* code) {
  Line line = gps_line(svid);
  line["ConstellationType"] = std::to_string(constellation);
  line["State"] = std::to_string(state);
  line["ReceivedSvTimeNanos"] = std::to_string(sent_ns);
  line["CarrierFrequencyHz"] = carrier_hz;
  line["CodeType"] = code;
  return line;
}

Line with(Line line, const std::string& column, const std::string& value) {
  line[column] = value;
  return line;
}

const std::vector<std::string> kNew{"TimeNanos",
                                    "FullBiasNanos",
                                    "BiasNanos",
                                    "HardwareClockDiscontinuityCount",
                                    "Svid",
                                    "TimeOffsetNanos",
                                    "State",
                                    "ReceivedSvTimeNanos",
                                    "ReceivedSvTimeUncertaintyNanos",
                                    "Cn0DbHz",
                                    "PseudorangeRateMetersPerSecond",
                                    "PseudorangeRateUncertaintyMetersPerSecond",
                                    "AccumulatedDeltaRangeState",
                                    "AccumulatedDeltaRangeMeters",
                                    "AccumulatedDeltaRangeUncertaintyMeters",
                                    "CarrierFrequencyHz",
                                    "MultipathIndicator",
                                    "ConstellationType",
                                    "BasebandCn0DbHz",
                                    "CodeType"};

std::string text_of(const std::vector<Line>& lines, const std::vector<std::string>& columns = kNew) {
  std::string text = fmt::format(
      "# \n# Header Description:\n# \n# Version: v3.0.6.4 Platform: 14 Manufacturer: Acme Model: One 2\n"
      "# Raw,utcTimeMillis,{}\n# \n",
      fmt::join(columns, ","));
  for (const Line& line : lines) {
    text += "Raw,1714474782000";
    for (const std::string& column : columns)
      text += "," + (line.count(column) > 0 ? line.at(column) : std::string());
    text += '\n';
  }
  return text;
}

class AndroidObservations : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& text) {
    std::ofstream(folder_ / "gnss_log.txt", std::ios::binary) << text;
    return folder_ / "gnss_log.txt";
  }
  /// Reads through the function used for every recording.
  RinexObservations read(const std::vector<Line>& lines, const std::vector<std::string>& columns = kNew) {
    ObservationOptions all;
    all.all_signals = true;
    return read_observations(write(text_of(lines, columns)), all);
  }
  TemporaryFolder folder_;
};

// The phone has had no first fix yet.
TEST_F(AndroidObservations, APhoneThatGuessesItsClockSaysNothing) {
  std::vector<std::string> columns = kNew;
  columns.emplace_back("BiasUncertaintyNanos");
  const RinexObservations file =
      read({with(gps_line(5), "BiasUncertaintyNanos", "2.5E9"),
            with(gps_line(5, kSecond_ns), "BiasUncertaintyNanos", "14.2"), gps_line(5, 2 * kSecond_ns)},
           columns);
  EXPECT_THAT(file.epochs, SizeIs(2));
  EXPECT_THAT(file.report.lines(), ElementsAre(HasSubstr("with a clock uncertainty above 10 ms")));
}

// One travel time in the time scale of each system: GLONASST is UTC + 3 h (18 leap seconds), BDT 14 s behind.
TEST_F(AndroidObservations, GivePseudorangesOfEverySystem) {
  constexpr std::int64_t kWeek_ns = kNow_ns % GpsTime::kNanosecondsPerWeek - kTravel_ns;
  constexpr std::int64_t kGlonass_ns = (kWeek_ns + (3 * 3600 - 18) * kSecond_ns) % (86'400 * kSecond_ns);
  const RinexObservations file = read({
      gps_line(5),
      line_of(3, 7, 32'768 + 128 + 1, kGlonass_ns, "1600312500", "C"),  // channel -3
      line_of(3, 9, 32'768 + 128 + 1, kGlonass_ns, "1600995000", "B"),  // code division
      line_of(6, 11, 16'384 + 8 + 1, kWeek_ns, "1575420000", "C"),
      line_of(6, 12, 2048 + 1024, kWeek_ns % 100'000'000, "1575420000", "C"),
      line_of(6, 12, 65'536 + 16'384 + 1, kWeek_ns, "1176450000", "Q"),
      line_of(5, 30, 16'384 + 1, kWeek_ns - 14 * kSecond_ns, "1561098000", "I"),
      line_of(4, 194, 16'384 + 1, kWeek_ns, "1575420000", "C"),
      line_of(1, 9, 4 + 1, kWeek_ns % (6 * kSecond_ns), "1575420000", "C"),
  });
  EXPECT_EQ(file.report.notes.losses(), 0U);
  EXPECT_EQ(file.header.format, "Android GnssLogger");
  EXPECT_EQ(file.header.receiver, "Acme One 2");
  ASSERT_THAT(file.epochs, SizeIs(1));
  EXPECT_EQ(file.epochs[0].receiver_time, GpsTime::from_nanoseconds(kNow_ns));
  std::vector<std::string> names;
  for (const ObservedSignal& s : file.epochs[0].signals) {
    names.push_back(gnss::to_string(s.id) + " " + s.code.data());
    ASSERT_TRUE(s.pseudorange_m) << names.back();
    EXPECT_NEAR(*s.pseudorange_m, 0.075 * kSpeedOfLight, 1e-6) << names.back();
    EXPECT_EQ(s.cn0_dbhz, 41.5);
  }
  EXPECT_THAT(names, ElementsAre("G05 1C", "G09 1C", "R07 1C", "R09 4B", "E11 1C", "E12 1C", "E12 5Q",
                                 "C30 2I", "J02 1C"));
}

TEST_F(AndroidObservations, GoByTheNamesOfTheHeader) {
  const RinexObservations file = read({gps_line()}, {kNew.rbegin(), kNew.rend()});
  EXPECT_NEAR(*file.epochs.at(0).signals.at(0).pseudorange_m, 0.075 * kSpeedOfLight, 1e-6);
}

// It has a blank before a name, and neither carriers nor codes.
TEST_F(AndroidObservations, ReadTheFirstVersionOfTheApp) {
  const auto path = write(
      "# Version: 1.4.0.0, Platform: N\n"
      "# Raw,ElapsedRealtimeMillis,TimeNanos,FullBiasNanos, "
      "Svid,State,ReceivedSvTimeNanos,ConstellationType\n" +
      fmt::format("Raw,1,{},{},5,15,{},1\n", kUptime_ns, kUptime_ns - kNow_ns,
                  kNow_ns % GpsTime::kNanosecondsPerWeek - kTravel_ns));
  const RinexObservations file = read_observations(path);
  ASSERT_THAT(file.epochs, SizeIs(1));
  ASSERT_THAT(file.epochs[0].signals, SizeIs(1));
  EXPECT_EQ(std::string(file.epochs[0].signals[0].code.data()), "1C");
  EXPECT_NEAR(*file.epochs[0].signals[0].pseudorange_m, 0.075 * kSpeedOfLight, 1e-6);
  EXPECT_FALSE(file.epochs[0].signals[0].doppler_hz);
}

// A phone's estimate of its clock changes from epoch to epoch; a change of the count means another clock.
TEST_F(AndroidObservations, HoldTheBiasUntilTheClockBeginsAnew) {
  const auto later = [](std::int64_t seconds, const char* bias, const char* count) {
    Line line = gps_line(5, seconds * kSecond_ns);
    line["FullBiasNanos"] = std::to_string(kUptime_ns - kNow_ns + 40 * seconds);
    line["BiasNanos"] = bias;
    line["HardwareClockDiscontinuityCount"] = count;
    return line;
  };
  const RinexObservations file = read({later(0, "0.25", "3"), later(1, "0.75", "3"), later(2, "-0.25", "4")});
  ASSERT_THAT(file.epochs, SizeIs(3));
  EXPECT_EQ(file.epochs[1].receiver_time, GpsTime::from_nanoseconds(kNow_ns + kSecond_ns));
  EXPECT_FALSE(file.epochs[1].power_failure);
  EXPECT_TRUE(file.epochs[2].power_failure);
  EXPECT_EQ(file.epochs[2].receiver_time, GpsTime::from_nanoseconds(kNow_ns + 2 * kSecond_ns - 80));
  const auto range = [&](std::size_t i) { return *file.epochs[i].signals.at(0).pseudorange_m; };
  EXPECT_NEAR(range(0), kSpeedOfLight * (0.075 - 0.25e-9), 1e-6);
  EXPECT_NEAR(range(1), kSpeedOfLight * (0.075 - 0.25e-9), 1e-6);
  EXPECT_NEAR(range(2), kSpeedOfLight * (0.075 - 80e-9 + 0.25e-9), 1e-6);
}

TEST_F(AndroidObservations, HaveNoPseudorangeThatTheStateLeavesOpen) {
  const RinexObservations file = read({
      gps_line(1),
      with(gps_line(2), "State", "3"),                          // 20 ms
      with(gps_line(3), "State", std::to_string(16'399 + 16)),  // ambiguous millisecond
      with(gps_line(4), "ReceivedSvTimeUncertaintyNanos", "667"),
      with(gps_line(6), "State", "16384"),          // no lock
      with(gps_line(7), "ConstellationType", "2"),  // SBAS
      with(gps_line(8), "FullBiasNanos", ""),
  });
  ASSERT_THAT(file.epochs, SizeIs(1));
  ASSERT_THAT(file.epochs[0].signals, SizeIs(4));
  for (const ObservedSignal& s : file.epochs[0].signals) {
    EXPECT_EQ(s.pseudorange_m.has_value(), s.id.number == 1) << gnss::to_string(s.id);
    EXPECT_EQ(s.cn0_dbhz, 41.5);
  }
  EXPECT_EQ(file.report.notes.losses(), 0U);
  const std::vector<std::string> warnings = file.report.lines();
  EXPECT_THAT(warnings, SizeIs(5)) << fmt::format("{}", fmt::join(warnings, "\n"));
  EXPECT_THAT(fmt::format("{}", fmt::join(warnings, "\n")), HasSubstr("line without code lock"));
}

TEST_F(AndroidObservations, GivePhaseAndDopplerByTheWavelength) {
  const auto phase = [](int svid, int state, const char* sigma = "0.001") {
    Line line = gps_line(svid);
    line["AccumulatedDeltaRangeState"] = std::to_string(state);
    line["AccumulatedDeltaRangeMeters"] = "-1234.5";
    line["AccumulatedDeltaRangeUncertaintyMeters"] = sigma;
    line["PseudorangeRateMetersPerSecond"] = "-350.25";
    return line;
  };
  Line glonass = phase(7, 25);
  glonass["ConstellationType"] = "3";
  glonass["CarrierFrequencyHz"] = "1.60031245E9";  // single precision of channel -3
  glonass["State"] = "3";
  Line moved = phase(9, 1);
  moved["TimeOffsetNanos"] = "1000000";
  const RinexObservations file =
      read({phase(1, 25), phase(2, 1 + 2), phase(3, 1 + 4 + 16), phase(4, 16), phase(5, 1, "3.4E38"),
            with(phase(6, 0), "PseudorangeRateUncertaintyMetersPerSecond", "11"), glonass, moved});
  ASSERT_THAT(file.epochs, SizeIs(1));
  std::map<int, ObservedSignal> seen;
  for (const ObservedSignal& s : file.epochs[0].signals) seen[s.id.number] = s;
  const double cycles = 1575.42e6 / kSpeedOfLight;
  for (const int svid : {1, 2, 3})
    EXPECT_NEAR(seen[svid].carrier_phase_cycles.value_or(0), -1234.5 * cycles, 1e-9) << svid;
  for (const int svid : {4, 5, 6}) EXPECT_FALSE(seen[svid].carrier_phase_cycles) << svid;
  EXPECT_EQ(seen[1].loss_of_lock, 0);
  EXPECT_EQ(seen[2].loss_of_lock, 1);
  EXPECT_EQ(seen[3].loss_of_lock, 3);
  EXPECT_NEAR(*seen[1].doppler_hz, 350.25 * cycles, 1e-9);
  EXPECT_FALSE(seen[6].doppler_hz);
  EXPECT_NEAR(*seen[7].carrier_phase_cycles, -1234.5 * 1600.3125e6 / kSpeedOfLight, 1e-9);
  // A millisecond later the satellite was 0.35 m nearer.
  EXPECT_NEAR(*seen[9].pseudorange_m, kSpeedOfLight * 0.076 + 0.35025, 1e-6);
  EXPECT_NEAR(*seen[9].carrier_phase_cycles, (-1234.5 + 0.35025) * cycles, 1e-9);
}

TEST_F(AndroidObservations, LoseBadLinesAlone) {
  const std::vector<Line> lines{gps_line(1),
                                with(gps_line(2), "ReceivedSvTimeNanos", "2.1E14"),
                                with(gps_line(3), "TimeNanos", std::to_string(kUptime_ns * 3)),
                                with(gps_line(4), "ReceivedSvTimeNanos", "212000000000000"),
                                with(gps_line(5), "Svid", "77"),
                                with(gps_line(6), "Cn0DbHz", "-40"),
                                gps_line(7),
                                gps_line(7),
                                with(gps_line(8), "FullBiasNanos", "-1"),
                                gps_line(9, kSecond_ns)};
  const RinexObservations file = read(lines);
  ASSERT_THAT(file.epochs, SizeIs(2));
  // The wrong TimeNanos split the epoch: the part before it is lost as well.
  ASSERT_THAT(file.epochs[0].signals, SizeIs(1));
  EXPECT_EQ(file.epochs[0].signals[0].id.number, 7);
  EXPECT_FALSE(file.epochs[1].power_failure);
  EXPECT_EQ(file.report.notes.losses(), 9U);
  EXPECT_EQ(file.report.epochs, 2U);
  EXPECT_EQ(file.report.observations, 2U);
  EXPECT_THAT(file.report.notes.lines(),
              testing::Contains(HasSubstr("gnss_log.txt:8: ReceivedSvTimeNanos '2.1E14' is not a number")));
  EXPECT_THAT(file.report.notes.lines(),
              testing::Contains(HasSubstr(":10: ReceivedSvTimeNanos 212000000000000 of "
                                          "G04 gives an impossible travel time")));
}

TEST_F(AndroidObservations, KeepTheBetterOfTwoCodes) {
  Line data = gps_line(12), pilot = gps_line(12);
  for (Line* line : {&data, &pilot}) (*line)["ConstellationType"] = "6";
  data["CodeType"] = "B";
  pilot["CodeType"] = "C";
  for (const auto& lines : {std::vector{data, pilot}, std::vector{pilot, data}}) {
    const RinexObservations file = read(lines);
    ASSERT_THAT(file.epochs.at(0).signals, SizeIs(1));
    EXPECT_EQ(std::string(file.epochs[0].signals[0].code.data()), "1C");
  }
  const RinexObservations one = read({with(pilot, "State", "1"), data});
  EXPECT_EQ(std::string(one.epochs.at(0).signals.at(0).code.data()), "1B");
}

TEST_F(AndroidObservations, SayWhatALogWithoutThemHas) {
  const auto path =
      write("# Fix,Provider,LatitudeDegrees,LongitudeDegrees\nFix,GPS,48.0,11.0\nStatus,1\nStatus,2\n");
  EXPECT_THAT(test::refusal([&] { (void)read_observations(path); }), HasSubstr("(it has Fix 1, Status 2)"));
  const auto headless = write("Raw,1,2,3\n");
  EXPECT_THAT(test::refusal([&] { (void)read_observations(headless); }),
              HasSubstr("gnss_log.txt:1: a line of 'Raw' before any header"));
}

}  // namespace
}  // namespace canyon::rinex
