#include "canyon/sky/rinex/observation_reader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <fstream>
#include <random>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "tests/support/observation_text.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::rinex {
namespace {

using geodesy::GpsTime;
using gnss::SatelliteId;
using gnss::System;
using simulation::test::error_of;
using simulation::test::TemporaryFolder;
using test::blank_field;
using test::field;
using test::header_line;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

RinexObservations read(const std::string& text, const ObservationOptions& options = {}) {
  RinexObservationReader reader(text, "some.obs", options);
  RinexObservations result;
  while (auto epoch = reader.next()) result.epochs.push_back(std::move(*epoch));
  result.header = reader.header();
  result.report = reader.report();
  return result;
}

std::string epoch3(int second, int count, int flag = 0) {
  return fmt::format("> 2019 04 28 12 44 {:2d}.0000000  {}{:3d}\n", second, flag, count);
}

GpsTime gps(int hour, int minute, int second, std::int64_t nanosecond = 0) {
  return geodesy::gps_from_calendar({2019, 4, 28, hour, minute, second, nanosecond});
}

const std::string kG05 = "G05" + field(20604864.859, ' ', '7') + field(108279273.141, '1', '6') +
                         field(1759.052) + field(29.0) + field(20604865.5) + "\n";

TEST(RinexObservation, Version3) {
  const auto file =
      read(test::observations3() + "> 2019 04 28 12 44 33.9970000  0  7      -0.123456789012\n" + kG05 +
           // L1 C/A lost: P(Y) replaces it, with its other values.
           "G 7" + blank_field() + blank_field('3') + blank_field() + blank_field() + field(21e6) +
           field(1.1e8) + "\n" + "R10" + field(19e6) + field(1e8) + field(-12.5) + field(41.25) + "\n" +
           "E11" + field(38.5) + field(-250000.0) + field(123456.789, '2') + field(24123456.789) + "\n" +
           "S20" + field(38e6) + field(40) + "\n" + "C03" + field(37139987.386) + field(193397630.185, '2') +
           field(0.0) + "\n" + "J01" + field(36e6) + "\n");
  const ObservationHeader& h = file.header;
  EXPECT_EQ(h.version, 3.04);
  EXPECT_EQ(h.system, 'M');
  EXPECT_EQ(h.program, "Receiver tool");
  EXPECT_EQ(h.marker, "ROOF");
  EXPECT_EQ(h.receiver, "M8T");
  EXPECT_EQ(h.antenna, "PATCH");
  EXPECT_EQ(h.approximate_position_ecef, Eigen::Vector3d(-2419215.8865, 5385498.5603, 2405403.6314));
  EXPECT_EQ(h.antenna_delta_hen, Eigen::Vector3d(1.5, 0.25, -0.125));
  EXPECT_EQ(h.interval_s, 0.5);
  EXPECT_EQ(h.first, gps(12, 44, 33, 997'000'000));
  EXPECT_EQ(h.last, std::nullopt);
  EXPECT_EQ(h.glonass_channels.at({System::GLONASS, 10}), -7);
  EXPECT_EQ(h.leap_seconds, 18);
  EXPECT_THAT(h.types.at('G'), SizeIs(14));
  EXPECT_EQ(h.types.at('G').back(), "L5Q");
  EXPECT_FALSE(h.clock_offset_applied);

  ASSERT_THAT(file.epochs, SizeIs(1));
  const ObservationEpoch& e = file.epochs[0];
  EXPECT_EQ(e.receiver_time, gps(12, 44, 33, 997'000'000));
  EXPECT_EQ(e.receiver_clock_offset_s, -0.123456789012);
  EXPECT_FALSE(e.power_failure);
  EXPECT_EQ(e.line, 21);
  ASSERT_THAT(e.signals, SizeIs(6));
  const auto& g05 = e.signals[0];
  EXPECT_EQ(g05.id, (SatelliteId{System::GPS, 5}));
  EXPECT_STREQ(g05.code.data(), "1C");
  EXPECT_EQ(g05.pseudorange_m, 20604864.859);
  EXPECT_EQ(g05.carrier_phase_cycles, 108279273.141);
  EXPECT_EQ(g05.doppler_hz, 1759.052);
  EXPECT_EQ(g05.cn0_dbhz, 29.0);
  EXPECT_FALSE(g05.cn0_from_indicator);
  EXPECT_EQ(g05.loss_of_lock, 1);
  const auto& g07 = e.signals[1];
  EXPECT_STREQ(g07.code.data(), "1W");
  EXPECT_EQ(g07.pseudorange_m, 21e6);
  EXPECT_EQ(g07.carrier_phase_cycles, 1.1e8);
  EXPECT_EQ(g07.doppler_hz, std::nullopt);
  EXPECT_EQ(g07.cn0_dbhz, std::nullopt);
  const auto& r10 = e.signals[2];
  EXPECT_EQ(r10.id, (SatelliteId{System::GLONASS, 10}));
  EXPECT_EQ(r10.doppler_hz, -12.5);
  EXPECT_EQ(r10.cn0_dbhz, 41.25);
  const auto& e11 = e.signals[3];  // separate columns, D1X divided by its factor
  EXPECT_STREQ(e11.code.data(), "1X");
  EXPECT_EQ(e11.pseudorange_m, 24123456.789);
  EXPECT_EQ(e11.carrier_phase_cycles, 123456.789);
  EXPECT_EQ(e11.doppler_hz, -2500.0);
  EXPECT_EQ(e11.cn0_dbhz, 38.5);
  EXPECT_EQ(e11.loss_of_lock, 2);
  EXPECT_EQ(e.signals[4].id, (SatelliteId{System::SBAS, 20}));
  EXPECT_STREQ(e.signals[4].code.data(), "1C");
  const auto& c03 = e.signals[5];
  EXPECT_STREQ(c03.code.data(), "2I");
  EXPECT_EQ(c03.doppler_hz, std::nullopt);  // 0.000: missing
  EXPECT_EQ(c03.cn0_dbhz, std::nullopt);
  EXPECT_EQ(file.report.notes.losses(), 0U);
  // No types for QZSS: no value of J01 can be read.
  EXPECT_THAT(file.report.lines(),
              ElementsAre(HasSubstr("satellite without an L1-band observation; left out")));
  EXPECT_EQ(file.report.epochs, 1U);
  EXPECT_EQ(file.report.observations, 6U);
}

TEST(RinexObservation, SignalStrengthDigitStandsForTheMiddleOfItsClass) {
  const auto file = read(test::observations3() + epoch3(35, 2) + "G05" + field(2e7, ' ', '7') + "\n" + "G06" +
                         field(2e7) + field(1e8, ' ', '3') + "\n");
  // 42 to 47 and 18 to 23 dB-Hz.
  EXPECT_EQ(file.epochs.at(0).signals.at(0).cn0_dbhz, 45);
  EXPECT_TRUE(file.epochs.at(0).signals.at(0).cn0_from_indicator);
  EXPECT_EQ(file.epochs.at(0).signals.at(1).cn0_dbhz, 21);
}

TEST(RinexObservation, EventsChangeTheHeaderAndCycleSlipsArePassedOver) {
  const auto file =
      read(test::observations3() + epoch3(35, 1) + kG05 + ">                              4  2\n" +
           header_line("G    2 S1C C1C", "SYS / # / OBS TYPES") + header_line("new antenna", "COMMENT") +
           epoch3(36, 1, 3) + header_line("STREET", "MARKER NAME") + epoch3(36, 1, 1) + "G05" + field(33) +
           field(2.1e7) + "\n" + epoch3(36, 1, 6) + "G05" + field(33) + field(2.1e7) + "\n" +
           epoch3(37, 0, 5) + epoch3(37, 0));
  ASSERT_THAT(file.epochs, SizeIs(3));
  EXPECT_EQ(file.epochs[0].signals[0].pseudorange_m, 20604864.859);
  EXPECT_TRUE(file.epochs[1].power_failure);
  EXPECT_EQ(file.epochs[1].signals.at(0).pseudorange_m, 2.1e7);
  EXPECT_EQ(file.epochs[1].signals.at(0).cn0_dbhz, 33);
  EXPECT_THAT(file.epochs[2].signals, SizeIs(0));
  EXPECT_EQ(file.header.marker, "STREET");
  EXPECT_EQ(file.report.notes.losses(), 0U);
  EXPECT_THAT(file.report.flags, ElementsAre(2, 1, 0, 1, 1, 1, 1));
}

// Four fields of 1X, A3, 1X, F8.3 (RINEX 3.05, table A2); blank: not known.
TEST(RinexObservation, GlonassBiases) {
  const auto biases = [](const std::string& record) {
    return read(header_line("     3.05           OBSERVATION DATA    R", "RINEX VERSION / TYPE") +
                header_line("R    2 C1C L1C", "SYS / # / OBS TYPES") +
                header_line(record, "GLONASS COD/PHS/BIS") + header_line("", "END OF HEADER"))
        .header.glonass_bias_m;
  };
  EXPECT_EQ(biases(" C1C  -71.940 C1P  -71.940 C2C    0.000 C2P         "),
            (std::map<std::string, double, std::less<>>{{"1C", -71.94}, {"1P", -71.94}, {"2C", 0}}));
  EXPECT_TRUE(biases("").empty());
  EXPECT_TRUE(biases(" C1C  -7x.940").empty());
}

TEST(RinexObservation, TimeSystems) {
  const auto time_of = [](char system, const std::string& time_system) {
    return read(header_line(std::string("     3.04           OBSERVATION DATA    ") + system,
                            "RINEX VERSION / TYPE") +
                header_line(std::string(1, system) + "    1 C" + (system == 'C' ? "2I" : "1C"),
                            "SYS / # / OBS TYPES") +
                header_line("  2019     4    28    12    44   34.0000000     " + time_system,
                            "TIME OF FIRST OBS") +
                header_line("", "END OF HEADER") + epoch3(34, 1) + system + "05" + field(2e7) + "\n")
        .epochs.at(0)
        .receiver_time;
  };
  EXPECT_EQ(time_of('G', "GPS"), gps(12, 44, 34));
  EXPECT_EQ(time_of('G', ""), gps(12, 44, 34));
  EXPECT_EQ(time_of('R', "GLO"), gps(12, 44, 52));  // UTC: 18 leap seconds in 2019
  EXPECT_EQ(time_of('R', ""), gps(12, 44, 52));
  EXPECT_EQ(time_of('R', "GPS"), gps(12, 44, 34));
  EXPECT_EQ(time_of('C', ""), gps(12, 44, 48));  // BDT is 14 s behind
  EXPECT_EQ(time_of('C', "BDT"), gps(12, 44, 48));
  EXPECT_EQ(time_of('E', ""), gps(12, 44, 34));
  EXPECT_EQ(time_of('J', ""), gps(12, 44, 34));
}

TEST(RinexObservation, SixtySecondsAreTheNextMinute) {
  const auto file = read(test::observations3() + epoch3(60, 1) + kG05);
  EXPECT_EQ(file.epochs.at(0).receiver_time, gps(12, 45, 0));
}

TEST(RinexObservation, BeiDouCodesFollowTheVersion) {
  const auto codes = [](const std::string& version, const std::string& types) {
    std::string text;
    const auto file =
        read(header_line("     " + version + "           OBSERVATION DATA    M", "RINEX VERSION / TYPE") +
             header_line("C    2 " + types, "SYS / # / OBS TYPES") + header_line("", "END OF HEADER") +
             epoch3(34, 1) + "C06" + field(2.1e7) + field(2.2e7) + "\n");
    const auto& signal = file.epochs.at(0).signals.at(0);
    return fmt::format("{} {:.0f}", signal.code.data(), *signal.pseudorange_m);
  };
  EXPECT_EQ(codes("3.02", "C1I C7I"), "1I 21000000");
  EXPECT_EQ(codes("3.02", "C7I C1X"), "1X 22000000");
  EXPECT_EQ(codes("3.03", "C1X C2I"), "2I 22000000");  // C1X: B1C
  EXPECT_EQ(codes("3.05", "C2I C1P"), "2I 21000000");
  EXPECT_THAT(
      error_of([&] { (void)codes("3.05", "C1X C1P"); }).what(),
      HasSubstr("some.obs: has no L1-band pseudorange of a wanted system (types of observation: C:C1X "
                "C:C1P)"));
}

ObservationOptions all_signals() {
  ObservationOptions options;
  options.all_signals = true;
  return options;
}

/// A pseudorange, identified by its excess over 20,000 km.
std::string code(double more_m) {
  return field(2e7 + more_m);
}

std::vector<std::string> names_of(const ObservationEpoch& epoch) {
  std::vector<std::string> names;
  for (const ObservedSignal& s : epoch.signals) {
    names.push_back(fmt::format("{} {} {} {:.0f}", gnss::to_string(s.id), s.signal->name, s.code.data(),
                                *s.pseudorange_m - 2e7));
  }
  return names;
}

// The table of codes next to that of signals: the tracked component of docs/signals.md is first.
TEST(RinexObservation, EverySignalHasItsCodes) {
  std::size_t signals = 0;
  for (const System system : gnss::kAllSystems) {
    std::set<std::string> taken;
    for (const gnss::Signal& signal : gnss::signals_of(system)) {
      const std::vector<std::string> codes = signal_codes(signal, 3.04);
      ASSERT_FALSE(codes.empty()) << signal.name;
      EXPECT_EQ(codes.front(), signal.code) << signal.name;
      for (const std::string& code : codes) EXPECT_TRUE(taken.insert(code).second) << code << " twice";
      ++signals;
    }
  }
  EXPECT_EQ(signals, 29U);
  EXPECT_THAT(default_codes(System::GPS, 3.04), ElementsAre("1C", "1S", "1L", "1X", "1P", "1W", "1Y"));
  const gnss::Signal& b1c = gnss::signals_of(System::BeiDou)[1];
  EXPECT_THAT(signal_codes(b1c, 3.02), IsEmpty()) << "1X is B1I's there";
  EXPECT_THAT(signal_codes(b1c, 3.03), ElementsAre("1P", "1X", "1D"));
}

// Codes of real receivers: every pseudorange of their headers belongs to a signal.
TEST(RinexObservation, RealHeadersAreKnownSignals) {
  std::set<std::string> names;
  for (const char* file : {"rtk-nagoya-20240624/rover.obs",
                           "urbannav-tst-20210517/20210517.light-urban.tste.ublox.f9p.splitter.obs",
                           "urbannav-tst-20210517/20210517.light-urban.tste.google.pixel4.obs",
                           "urbannav-tst-20190428/COM3_190428_124409.obs"}) {
    CANYON_SHARED_DATA(path, file);
    RinexObservationReader reader(path, all_signals());
    for (int i = 0; i < 60; ++i) {
      const auto epoch = reader.next();
      if (!epoch) break;
      for (const ObservedSignal& signal : epoch->signals) {
        names.insert(fmt::format("{} {}", gnss::name(signal.id.system), signal.signal->name));
      }
    }
    EXPECT_THAT(reader.report().unknown_codes, IsEmpty());
  }
  EXPECT_THAT(names, testing::IsSupersetOf({"GPS L1CA", "GPS L2C", "GPS L5", "GLONASS G1", "GLONASS G2",
                                            "Galileo E1", "Galileo E5a", "Galileo E5b", "BeiDou B1I",
                                            "BeiDou B2I", "BeiDou B3I", "QZSS L1CA"}));
}

// RINEX 3.05, tables 4 and 9: C/A on L2, of L5S data and pilot together; Q instead of J.
TEST(RinexObservation, CodesAndNamesThatStandForOthers) {
  const auto file =
      read(header_line("     3.04           OBSERVATION DATA    M", "RINEX VERSION / TYPE") +
               header_line("G    1 C2C", "SYS / # / OBS TYPES") +
               header_line("Q    2 C5Z C1C", "SYS / # / OBS TYPES") + header_line("", "END OF HEADER") +
               epoch3(34, 2) + "G05" + code(2) + "\n" + "Q02" + code(5) + code(1) + "\n",
           all_signals());
  EXPECT_THAT(names_of(file.epochs.at(0)), ElementsAre("G05 L2C 2C 2", "J02 L1CA 1C 1", "J02 L5 5Z 5"));
  EXPECT_THAT(file.report.lines(), ElementsAre());
}

TEST(RinexObservation, AllSignals) {
  const std::string text = header_line("     3.04           OBSERVATION DATA    M", "RINEX VERSION / TYPE") +
                           header_line("G    9 C5X C2W C2X C1C C1L C9Z L5X X1  L9Z", "SYS / # / OBS TYPES") +
                           header_line("C    3 C2I C7D C6I", "SYS / # / OBS TYPES") +
                           header_line("E    3 C8X C5Q C4X", "SYS / # / OBS TYPES") +
                           header_line("", "END OF HEADER") + epoch3(34, 4) +
                           // L5, P(Y) on L2, L2C, C/A, L1C, a code that does not exist, phase of L5.
                           "G05" + code(5) + code(20) + code(2) + code(1) + code(11) + code(9) +
                           field(55, '1') + "\n" + "G06" + blank_field() + code(20) + blank_field() +
                           blank_field() + code(11) + "\n" + "C06" + code(1) + code(7) + code(6) + "\n" +
                           "E08" + code(8) + code(5) + "\n";
  const auto file = read(text, all_signals());
  EXPECT_THAT(names_of(file.epochs.at(0)),
              ElementsAre("G05 L1CA 1C 1", "G05 L1C 1L 11", "G05 L2C 2X 2", "G05 L5 5X 5", "G05 L2P 2W 20",
                          "G06 L1C 1L 11", "G06 L2P 2W 20", "C06 B1I 2I 1", "C06 B3I 6I 6", "C06 B2b 7D 7",
                          "E08 E5a 5Q 5", "E08 E5 8X 8"));
  const auto& signals = file.epochs[0].signals;
  EXPECT_EQ(signals[3].carrier_phase_cycles, 55);
  EXPECT_EQ(signals[3].loss_of_lock, 1);
  EXPECT_TRUE(signals[0].first());
  EXPECT_FALSE(signals[1].first());
  EXPECT_FALSE(signals[5].first()) << "L1C does not stand in for C/A where it is read itself";
  EXPECT_EQ(file.report.observations, 12U);
  EXPECT_THAT(file.report.lines(), ElementsAre("1 codes of E not known: 4X", "1 codes of G not known: 9Z"));

  // One of each satellite, as before.
  const auto one = read(text);
  EXPECT_THAT(names_of(one.epochs.at(0)), ElementsAre("G05 L1CA 1C 1", "G06 L1CA 1L 11", "C06 B1I 2I 1"));
  EXPECT_THAT(one.report.lines(),
              ElementsAre(HasSubstr("satellite without an L1-band observation; left out")));

  // A damaged field drops all of the satellite's signals.
  EXPECT_THAT(names_of(read(text + epoch3(35, 2) + "G05" + code(5) + code(20) + code(2) + code(1) +
                                "      x       \n" + "E08" + code(8) + code(5) + "\n",
                            all_signals())
                           .epochs.at(1)),
              ElementsAre("E08 E5a 5Q 5", "E08 E5 8X 8"));

  const std::string unknown =
      header_line("     3.04           OBSERVATION DATA    G", "RINEX VERSION / TYPE") +
      header_line("G    2 C9Z L9Z", "SYS / # / OBS TYPES") + header_line("", "END OF HEADER");
  EXPECT_THAT(
      error_of([&] { (void)read(unknown, all_signals()); }).what(),
      HasSubstr("has no pseudorange of a known signal of a wanted system (types of observation: G:C9Z "
                "G:L9Z)"));
}

// RINEX 4.00 (Romero 2021), tables A2 and A3: observations as in 3.05, with new header records.
TEST(RinexObservation, Version4) {
  const auto file = read(
      header_line("     4.00           OBSERVATION DATA    M", "RINEX VERSION / TYPE") +
          header_line("https://doi.org/10.1000/182", "DOI") + header_line("CC BY 4.0", "LICENSE OF USE") +
          header_line("https://example.org/station", "STATION INFORMATION") +
          header_line("G    8 C1C L1C D1C S1C C5Q L5Q D5Q S5Q", "SYS / # / OBS TYPES") +
          header_line("G L5Q -0.25000", "SYS / PHASE SHIFT") +
          header_line("  2022     6     8    12    44   34.0000000     GPS", "TIME OF FIRST OBS") +
          header_line("", "END OF HEADER") + "> 2022 06 08 12 44 34.0000000  0  1\n" + "G05" + code(1) +
          field(1.1e8, ' ', '7') + field(-12.5) + field(45) + code(2) + field(8.2e7, '2') + field(-9.25) +
          field(47) + "\n",
      all_signals());
  EXPECT_EQ(file.header.version, 4.0);
  ASSERT_THAT(names_of(file.epochs.at(0)), ElementsAre("G05 L1CA 1C 1", "G05 L5 5Q 2"));
  const ObservedSignal& l5 = file.epochs[0].signals[1];
  EXPECT_EQ(l5.carrier_phase_cycles, 8.2e7);
  EXPECT_EQ(l5.loss_of_lock, 2);
  EXPECT_EQ(l5.doppler_hz, -9.25);
  EXPECT_EQ(l5.cn0_dbhz, 47);
  EXPECT_THAT(file.report.lines(), IsEmpty());
}

// Signals that are only in recordings.
TEST(RinexObservation, SignalsThatNoReceiverHereTracks) {
  const auto file =
      read(header_line("     3.04           OBSERVATION DATA    M", "RINEX VERSION / TYPE") +
               header_line("R    4 C1C C3Q C4X C6B", "SYS / # / OBS TYPES") +
               header_line("E    3 C1C C6C C8Q", "SYS / # / OBS TYPES") +
               header_line("S    2 C1C C5I", "SYS / # / OBS TYPES") +
               header_line("C    2 C2I C8D", "SYS / # / OBS TYPES") +
               header_line("J    2 C1C C6X", "SYS / # / OBS TYPES") + header_line("", "END OF HEADER") +
               epoch3(34, 5) + "R09" + code(1) + code(3) + code(4) + code(6) + "\n" + "E08" + code(1) +
               code(6) + code(8) + "\n" + "S23" + code(1) + code(5) + "\n" + "C27" + code(1) + code(8) +
               "\n" + "J02" + code(1) + code(6) + "\n",
           all_signals());
  EXPECT_THAT(names_of(file.epochs.at(0)),
              ElementsAre("R09 G1 1C 1", "R09 G3 3Q 3", "R09 G1a 4X 4", "R09 G2a 6B 6", "E08 E1 1C 1",
                          "E08 E6 6C 6", "E08 E5 8Q 8", "S23 L1CA 1C 1", "S23 L5 5I 5", "C27 B1I 2I 1",
                          "C27 B2 8D 8", "J02 L1CA 1C 1", "J02 L6 6X 6"));
  EXPECT_THAT(file.report.lines(), IsEmpty());
}

// RINEX 2.11, table A1, and 2.12, table A1: CA, CB, CC and CD for C/A, L1C, L2C and GLONASS's C/A of L2.
TEST(RinexObservation, AllSignalsOfVersion2) {
  const auto of = [](const std::string& version, const std::string& types) {
    const auto types_of = split_blanks(types);
    std::string header = fmt::format("{:6}", types_of.size()), fields;
    for (std::size_t i = 0; i < types_of.size(); ++i) {
      header += fmt::format("{:>6}", types_of[i]);
      const auto value = 1 + static_cast<double>(i);
      fields += types_of[i][0] == 'L' || types_of[i][0] == 'S' ? field(value) : code(value);
      if (i % 5 == 4 || i + 1 == types_of.size()) fields += "\n";
    }
    return read(
        header_line("     " + version + "           OBSERVATION DATA    M (MIXED)", "RINEX VERSION / TYPE") +
            header_line(header, "# / TYPES OF OBSERV") + header_line("", "END OF HEADER") +
            " 19  4 28 12 44 34.0000000  0  4G05R06E07C08\n" + fields + fields + fields + fields,
        all_signals());
  };
  const auto older = of("2.11", "C1 L1 P1 C2 P2 L2 C5 S5 C7");
  EXPECT_THAT(names_of(older.epochs.at(0)),
              ElementsAre("G05 L1CA 1C 1", "G05 L2C 2X 4", "G05 L5 5X 7", "G05 L2P 2W 5", "R06 G1 1C 1",
                          "R06 G2 2C 4", "E07 E1 1C 1", "E07 E5a 5X 7", "E07 E5b 7X 9", "C08 B1I 2I 1",
                          "C08 B2I 7I 9"));
  EXPECT_EQ(older.epochs[0].signals[0].carrier_phase_cycles, 2);
  EXPECT_EQ(older.epochs[0].signals[1].carrier_phase_cycles, 6);
  EXPECT_EQ(older.epochs[0].signals[2].cn0_dbhz, 8);
  EXPECT_THAT(older.report.lines(), IsEmpty()) << "P2 is GLONASS's";

  const auto newer = of("2.12", "C1 CA CB CC LC C2 L2 CD C8");
  EXPECT_THAT(names_of(newer.epochs.at(0)),
              ElementsAre("G05 L1CA 1C 2", "G05 L1C 1X 3", "G05 L2C 2X 4", "R06 G1 1C 2", "R06 G2 2C 8",
                          "E07 E1 1C 1", "E07 E5 8X 9", "C08 B1I 2I 6"));
  EXPECT_EQ(newer.epochs[0].signals[2].carrier_phase_cycles, 5);
  EXPECT_EQ(newer.epochs[0].signals.back().carrier_phase_cycles, 7);
  EXPECT_THAT(newer.report.lines(), IsEmpty());
}

TEST(RinexObservation, CodesAndSystemsCanBeChosen) {
  ObservationOptions options;
  options.codes[System::GPS] = {"1W"};
  options.systems = {System::GPS};
  const auto file = read(test::observations3() + epoch3(34, 2) + kG05 + "R10" + field(2e7) + "\n", options);
  ASSERT_THAT(file.epochs.at(0).signals, SizeIs(1));
  EXPECT_EQ(file.epochs[0].signals[0].pseudorange_m, 20604865.5);
  EXPECT_EQ(file.report.notes.count("observation of GLONASS"), 1U);
  options.codes[System::GPS] = {"C1C"};
  EXPECT_THAT(error_of([&] { options.validate(); }).what(),
              HasSubstr("codes: 'C1C' of GPS is not an observation code; give a band's digit"));
  options.systems.clear();
  EXPECT_THAT(error_of([&] { options.validate(); }).what(), HasSubstr("systems: none is given"));
}

TEST(RinexObservation, Version2) {
  std::string text = test::observations2() +
                     " 19  4 28 12 44 34.0000000  0 14G 5G 6G 7G 8G 9G10G11G12  3G14G15R16 0.000012345\n" +
                     "                                E17S20\n";
  const auto satellite = [&text](double range, const std::string& phase, bool p1) {
    // L1 L2 C1 P1 P2 | D1 D2 S1 S2 C2
    text += phase + blank_field() + (p1 ? blank_field() + field(range) : field(range)) + "\n";
    text += field(-1000.5) + blank_field() + field(44) + "\n";
  };
  for (int i = 0; i < 14; ++i) satellite(2e7 + i, field(1e8 + i, i == 1 ? '1' : ' '), i == 2);
  // An event without a date, a satellite whose lines are blank, an odd number of years.
  text += "                            4  1\n" + header_line("tunnel", "COMMENT");
  text += " 19  4 28 12 44 35.0000000  0  2G 5G 6\n\n\n" + field(1e8) + blank_field() + field(3e7) + "\n\n";
  const auto file = read(text);
  ASSERT_THAT(file.epochs, SizeIs(2));
  const ObservationEpoch& e = file.epochs[0];
  EXPECT_EQ(e.receiver_time, gps(12, 44, 34));
  EXPECT_EQ(e.receiver_clock_offset_s, 0.000012345);
  ASSERT_THAT(e.signals, SizeIs(14));
  EXPECT_EQ(e.signals[0].pseudorange_m, 2e7);
  EXPECT_EQ(e.signals[0].doppler_hz, -1000.5);
  EXPECT_EQ(e.signals[0].cn0_dbhz, 44);
  EXPECT_STREQ(e.signals[0].code.data(), "1C");
  EXPECT_EQ(e.signals[1].loss_of_lock, 1);
  EXPECT_STREQ(e.signals[2].code.data(), "1P");
  EXPECT_EQ(e.signals[2].pseudorange_m, 20000002);
  EXPECT_EQ(e.signals[8].id, (SatelliteId{System::GPS, 3}));  // a blank letter is GPS
  EXPECT_EQ(e.signals[11].id, (SatelliteId{System::GLONASS, 16}));
  EXPECT_EQ(e.signals[12].id, (SatelliteId{System::Galileo, 17}));
  EXPECT_EQ(e.signals[12].pseudorange_m, 20000012);
  EXPECT_EQ(e.signals[13].id, (SatelliteId{System::SBAS, 20}));
  EXPECT_EQ(e.signals[13].pseudorange_m, 20000013);
  ASSERT_THAT(file.epochs[1].signals, SizeIs(1));
  EXPECT_EQ(file.epochs[1].signals[0].pseudorange_m, 3e7);
  EXPECT_EQ(file.report.notes.losses(), 0U);
  EXPECT_EQ(file.header.types.at(' ').back(), "C2");
}

TEST(RinexObservation, TwoDigitYears) {
  const std::string rest =
      "  4 28 12 44 34.0000000  0  1G 5\n" + blank_field() + blank_field() + field(2e7) + "\n\n";
  EXPECT_EQ(read(test::observations2() + " 98" + rest).epochs.at(0).receiver_time,
            geodesy::gps_from_calendar({1998, 4, 28, 12, 44, 34, 0}));
  EXPECT_EQ(read(test::observations2() + " 09" + rest).epochs.at(0).receiver_time,
            geodesy::gps_from_calendar({2009, 4, 28, 12, 44, 34, 0}));
}

TEST(RinexObservation, DamagedLinesAreLeftOutAlone) {
  const auto file = read(test::observations3() + epoch3(34, 5) + kG05 +                  // lines 21, 22
                         "G06  2x604864.859\n" +                                         // 23
                         "@12" + field(2e7) + "\n" + kG05 + "G08" + field(2e7) + "\n" +  // 24 to 26
                         "> 2019 04 28 12 44 xx.0000000  0  1\n" + kG05 +                // 27
                         epoch3(33, 1) + kG05 +                                          // 29: goes back
                         epoch3(35, 3) + kG05 +                              // 31: two are missing
                         epoch3(36, 1) + kG05 + "G09" + field(2e7) + "\n" +  // one too many: 35
                         epoch3(37, 2) + kG05);                              // cut short
  ASSERT_THAT(file.epochs, SizeIs(4));
  ASSERT_THAT(file.epochs[0].signals, SizeIs(2));
  EXPECT_EQ(file.epochs[0].signals[1].id, (SatelliteId{System::GPS, 8}));
  EXPECT_THAT(
      file.report.notes.lines(),
      ElementsAre(HasSubstr("some.obs:23: an observation of G06 is not a number in its columns; left out"),
                  HasSubstr("some.obs:24: '@12' is not a satellite"),
                  HasSubstr("some.obs:25: G05 twice in one epoch"),
                  HasSubstr("some.obs:27: no epoch line, with all that follows to the next one (the "
                            "first of 2); left out"),
                  HasSubstr("some.obs:29: time of the epoch does not follow"),
                  HasSubstr("the epoch of line 31 ends after 1 of 3 satellites (the first of 2)")));
  EXPECT_EQ(file.report.notes.losses(), 8U);
}

TEST(RinexObservation, DamagedVersion2FindsItsWayBack) {
  const std::string satellite = field(1e8) + blank_field() + field(2e7) + "\n" + field(-10) + "\n";
  const auto file =
      read(test::observations2() + " 19  4 28 12 44 34.0000000  0  2G 5G 6\n" + satellite +  // one is missing
           " 19  4 28 12 44 35.0000000  0  1G 5\n" + satellite + satellite +                 // one too many
           " 19  4 28 12 44 36.0000000  0  1G 5\n" + satellite + " 19  4 28 12 44 37.0000000  0  1G?5\n" +
           satellite + " 19  4 28 12 44 38.0000000  0  1G 5\n" + satellite);
  ASSERT_THAT(file.epochs, SizeIs(5 - 0));
  EXPECT_THAT(file.report.notes.lines(),
              ElementsAre(HasSubstr("ends after 1 of 2"), HasSubstr(":13: no epoch line"),
                          HasSubstr("'G?5' is not a satellite")));
}

TEST(RinexObservation, ImpossibleValuesAreLeftOutAlone) {
  const auto file = read(test::observations3() + epoch3(34, 2) + "G05" + field(1e9) + field(1.1e8) +
                         field(1e6) + field(999) + "\nG06" + field(20604.864) + blank_field() + field(-100) +
                         field(-1) + "\n" + epoch3(35, 1) + kG05);
  ASSERT_THAT(file.epochs, SizeIs(2));
  ASSERT_THAT(file.epochs[0].signals, SizeIs(2));
  const ObservedSignal& g05 = file.epochs[0].signals[0];
  EXPECT_EQ(g05.pseudorange_m, std::nullopt);
  EXPECT_EQ(g05.carrier_phase_cycles, 1.1e8);
  EXPECT_EQ(g05.doppler_hz, std::nullopt);
  EXPECT_EQ(g05.cn0_dbhz, std::nullopt);
  EXPECT_EQ(file.epochs[0].signals[1].doppler_hz, -100);
  EXPECT_THAT(
      file.report.lines(),
      ElementsAre(HasSubstr("some.obs:22: 'G05' has a pseudorange of 1000000000 m (the first of 2); values "
                            "outside 1e+07 to 1e+08 are left out"),
                  HasSubstr("some.obs:22: 'G05' has a Doppler of 1000000 Hz"),
                  HasSubstr("some.obs:22: 'G05' has a C/N0 of 999 dB-Hz")));
}

// A wrong date that breaks the order loses its epoch, or one more, and stretches nothing.
TEST(RinexObservation, OneWrongDateCostsItsEpoch) {
  const TemporaryFolder folder;
  constexpr const char *kLater = "> 2031 04 28", *kEarlier = "> 2011 04 28";
  for (const auto& [wrong, date] :
       std::vector<std::pair<int, const char*>>{{0, kLater}, {7, kLater}, {7, kEarlier}, {19, kEarlier}}) {
    std::string text = test::observations3();
    for (int k = 0; k < 20; ++k) {
      std::string epoch = epoch3(k, 1);
      if (k == wrong) epoch.replace(0, 12, date);
      text += epoch + kG05;
    }
    const RinexObservations file = read_rinex_observations(folder.write("dates.obs", text));
    EXPECT_GE(file.epochs.size(), 18U) << wrong << date;
    EXPECT_LT(file.epochs.back().receiver_time - file.epochs.front().receiver_time, 20) << wrong << date;
    EXPECT_EQ(file.report.notes.losses(), 20 - file.epochs.size());
  }
}

// The second file has its types in another order.
TEST(RinexObservation, FilesJoinedWithTheirHeaders) {
  const auto file =
      read(test::observations3() + epoch3(34, 1) + kG05 +
           header_line("     3.04           OBSERVATION DATA    M: MIXED", "RINEX VERSION / TYPE") +
           header_line("G    2 S1C C1C", "SYS / # / OBS TYPES") + header_line("", "END OF HEADER") +
           epoch3(35, 1) + "G05" + field(41) + field(2.1e7) + "\n");
  ASSERT_THAT(file.epochs, SizeIs(2));
  EXPECT_EQ(file.epochs[1].signals.at(0).pseudorange_m, 2.1e7);
  EXPECT_EQ(file.epochs[1].signals.at(0).cn0_dbhz, 41);
  EXPECT_THAT(file.report.lines(), IsEmpty());
}

// Programs in MATLAB and Python write missing values like this.
TEST(RinexObservation, NanIsAMissingValue) {
  std::string row = kG05;
  row.replace(row.find(" 20604864.859"), 13, "          NaN");
  const auto file = read(test::observations3() + epoch3(34, 1) + row);
  ASSERT_THAT(file.epochs, SizeIs(1));
  ASSERT_THAT(file.epochs[0].signals, SizeIs(1));
  // The value of the other code is used.
  EXPECT_EQ(file.epochs[0].signals[0].pseudorange_m, 20604865.5);
  EXPECT_THAT(file.report.lines(), IsEmpty());
}

// RINEX 2.11, table A2, and 3.05, table A3: missing observations are written as 0.0 or blanks.
TEST(RinexObservation, ZerosAreMissing) {
  const std::string row = field(21e6, '0', '7') + field(0, '1', '5') + field(-0.0, ' ', '4') + field(0);
  std::string four = test::observations3();
  four.replace(four.find("3.04"), 4, "4.00");
  for (const std::string& text :
       {test::observations3() + epoch3(34, 1) + "G05" + row + "\n", four + epoch3(34, 1) + "G05" + row + "\n",
        test::observations2() + " 19  4 28 12 44 34.0000000  0  1G 5\n" + field(0, '1', '5') + blank_field() +
            field(21e6, '0', '7') + blank_field() + blank_field() + "\n" + field(0, ' ', '4') +
            blank_field() + field(0) + "\n"}) {
    const auto file = read(text);
    ASSERT_THAT(file.epochs.at(0).signals, SizeIs(1)) << text;
    const ObservedSignal& signal = file.epochs[0].signals[0];
    EXPECT_EQ(signal.pseudorange_m, 21e6);
    EXPECT_EQ(signal.carrier_phase_cycles, std::nullopt);
    EXPECT_EQ(signal.doppler_hz, std::nullopt);
    EXPECT_EQ(signal.cn0_dbhz, 45);  // the digit next to the pseudorange
    EXPECT_EQ(signal.loss_of_lock, 1);
    EXPECT_EQ(file.report.notes.losses(), 0U);
  }
  const auto nothing =
      read(test::observations3() + epoch3(34, 1) + "G05" + field(0) + field(0) + field(0) + field(0) + "\n");
  EXPECT_THAT(nothing.epochs.at(0).signals, IsEmpty());
}

// RINEX 3.05, 6.5: a header record applies until another one changes it.
TEST(RinexObservation, HeaderRecordsHoldFromWhereTheyStand) {
  const Eigen::Vector3d first(-2419215.8865, 5385498.5603, 2405403.6314);
  const std::string moved = header_line(" -2419215.8865  5385498.5603  2406403.6314", "APPROX POSITION XYZ");
  const std::string raised =
      header_line("        3.5000        0.2500       -0.1250", "ANTENNA: DELTA H/E/N");
  const auto events = [&](const std::string& records, int flag, int count) {
    return read(test::observations3() + epoch3(34, 1) + kG05 + epoch3(35, count, flag) + records +
                epoch3(36, 1) + kG05);
  };
  const auto index = [](const RinexObservations& file, std::size_t epoch) {
    return file.epochs.at(epoch).header->antenna_ecef().value();
  };
  for (const auto& file :
       {events(moved, 3, 1), events(moved + header_line("joined here", "COMMENT"), 4, 2),
        read(test::observations3() + epoch3(34, 1) + kG05 +
             header_line("     3.04           OBSERVATION DATA    M: MIXED", "RINEX VERSION / TYPE") + moved +
             header_line("        1.5000        0.2500       -0.1250", "ANTENNA: DELTA H/E/N") +
             header_line("G    4 C1C L1C D1C S1C", "SYS / # / OBS TYPES") + header_line("", "END OF HEADER") +
             epoch3(36, 1) + kG05)}) {
    ASSERT_THAT(file.epochs, SizeIs(2));
    EXPECT_EQ(file.epochs[0].header->approximate_position_ecef, first);
    EXPECT_NEAR((index(file, 1) - index(file, 0)).norm(), 1000, 1e-3);
    EXPECT_THAT(
        file.report.lines(),
        ElementsAre(HasSubstr("header records within the file move the antenna; they apply from there on")));
  }
  const auto up = events(raised, 4, 1);
  EXPECT_NEAR((index(up, 1) - index(up, 0)).norm(), 2, 1e-6);
  EXPECT_NEAR((index(up, 1) - index(up, 0)).dot(first.normalized()), 2, 1e-4);
  EXPECT_EQ(up.epochs[0].header->antenna_delta_hen, Eigen::Vector3d(1.5, 0.25, -0.125));

  const auto renamed = events(header_line("ROOF 2", "MARKER NAME"), 3, 1);
  EXPECT_EQ(renamed.epochs[0].header->marker, "ROOF");
  EXPECT_EQ(renamed.epochs[1].header->marker, "ROOF 2");
  EXPECT_FALSE(renamed.epochs[1].header->antenna_ecef());
  EXPECT_THAT(renamed.report.lines(),
              ElementsAre(HasSubstr(":23: event of a new site without its position")));
  const auto again = events(header_line("ROOF", "MARKER NAME"), 3, 1);
  EXPECT_EQ(index(again, 1), index(again, 0));
  EXPECT_THAT(again.report.lines(), IsEmpty());
  // A moving antenna has no position until it is stationary again.
  const auto driven = read(test::observations3() + epoch3(34, 1) + kG05 + epoch3(35, 0, 2) + epoch3(36, 1) +
                           kG05 + epoch3(37, 1, 3) + moved + epoch3(38, 1) + kG05);
  EXPECT_FALSE(driven.epochs.at(1).header->antenna_ecef());
  EXPECT_NEAR((index(driven, 2) - index(driven, 0)).norm(), 1000, 1e-3);
  EXPECT_EQ(up.epochs[0].header->types, up.epochs[1].header->types);
}

TEST(RinexObservation, APlaceOnNoEarthIsNone) {
  std::string text = test::observations3();
  const std::string location = " -2419215.8865  5385498.5603  2405403.6314";
  text.replace(text.find(location), location.size(), "       22.3000      114.1700        5.0000");
  const auto file = read(text + epoch3(34, 1) + kG05);
  EXPECT_FALSE(file.header.approximate_position_ecef);
  EXPECT_THAT(file.report.lines(),
              ElementsAre(HasSubstr("APPROX POSITION XYZ is 0 km from the Earth's centre")));
}

TEST(RinexObservation, EpochsInReverseAreRefused) {
  const TemporaryFolder folder;
  std::ofstream out(folder / "some.obs");
  out << test::observations3();
  for (int second = 50; second >= 40; --second) out << epoch3(second, 1) + kG05;
  out.close();
  EXPECT_THAT(std::string(error_of([&] { (void)read_rinex_observations(folder / "some.obs"); }).what()),
              AllOf(HasSubstr("the times of 10 of 11 epochs do not follow one another"),
                    HasSubstr("sort the epochs")));
}

TEST(RinexObservation, ManyDamagesAreCounted) {
  std::string text = test::observations3();
  for (int i = 0; i < 30; ++i) text += "> damaged\n";
  const auto file = read(text);
  EXPECT_EQ(file.report.notes.losses(), 30U);
  EXPECT_THAT(file.report.lines(), ElementsAre(HasSubstr("(the first of 30); left out")));
}

TEST(RinexObservation, WrongFilesAreOneError) {
  const auto what = [](const std::string& text) {
    return std::string(error_of([&] { (void)read(text); }).what());
  };
  EXPECT_THAT(what(""), HasSubstr("some.obs: is empty"));
  EXPECT_THAT(what("week,tow\n"), HasSubstr("some.obs:1: is not a RINEX file: the first line is not"));
  EXPECT_THAT(what(header_line("4.0                 COMPACT RINEX FORMAT", "CRINEX VERS   / TYPE")),
              HasSubstr("version '4.0' of Hatanaka's compression is not supported; versions 1.0 and 3.0"));
  EXPECT_THAT(what(header_line("     3.04           N: GNSS NAV DATA    G", "RINEX VERSION / TYPE")),
              HasSubstr("this is a navigation file"));
  EXPECT_THAT(what(header_line("     5.00           OBSERVATION DATA", "RINEX VERSION / TYPE")),
              HasSubstr("RINEX version '5.00' is not supported"));
  EXPECT_THAT(what(header_line("     3.04           OBSERVATION DATA", "RINEX VERSION / TYPE")),
              HasSubstr("no END OF HEADER"));
  EXPECT_THAT(what(header_line("     3.04           OBSERVATION DATA", "RINEX VERSION / TYPE") +
                   header_line("G   xx C1C", "SYS / # / OBS TYPES")),
              HasSubstr("some.obs:2: number of observation types is damaged"));
  EXPECT_THAT(what(header_line("     3.04           OBSERVATION DATA", "RINEX VERSION / TYPE") +
                   header_line("  2019     4    28    12    44   34.0000000     XYZ", "TIME OF FIRST OBS")),
              HasSubstr("time system 'XYZ' is unknown"));
}

// Like a plain file cut after a line: the complete epochs, and a warning.
TEST(RinexObservation, GzipThatEndsEarlyIsReadUpToThere) {
  const TemporaryFolder folder;
  std::string text = test::observations3();
  std::mt19937 random(1);  // digits that do not compress
  for (int i = 0; i < 3'000; ++i) {
    text += fmt::format("> 2019 04 28 {:2} {:2} {:2}.0000000  0  1\nG05{}\n", i / 3600, i / 60 % 60, i % 60,
                        field(2e7 + 1e-3 * static_cast<double>(random() % 1'000'000'000)));
  }
  const auto packed = folder.path() / "packed.obs.gz";
  gzFile out = gzopen(packed.c_str(), "wb");
  ASSERT_NE(out, nullptr);
  gzwrite(out, text.data(), static_cast<unsigned>(text.size()));
  gzclose(out);
  const auto whole = read_rinex_observations(packed);
  ASSERT_THAT(whole.epochs, SizeIs(3'000));
  EXPECT_THAT(whole.report.notes.lines(), IsEmpty());

  std::filesystem::resize_file(packed, std::filesystem::file_size(packed) / 2);
  const auto cut = read_rinex_observations(packed);
  ASSERT_GT(cut.epochs.size(), 1'000U);
  ASSERT_LT(cut.epochs.size(), 2'000U);
  for (std::size_t i = 0; i + 1 < cut.epochs.size(); ++i) {
    ASSERT_EQ(cut.epochs[i].signals.at(0).pseudorange_m, whole.epochs[i].signals.at(0).pseudorange_m);
  }
  EXPECT_THAT(cut.report.lines(), Contains(HasSubstr(": the gzip data end early; read up to here")));
}

TEST(RinexObservation, FilesPlainAndGzip) {
  const TemporaryFolder folder;
  const std::string text = test::observations3() + epoch3(34, 1) + kG05;
  const auto plain = folder.write("plain.obs", text);
  EXPECT_EQ(read_rinex_observations(plain).report.observations, 1U);

  const auto packed = folder.path() / "packed.obs";
  gzFile out = gzopen(packed.c_str(), "wb");
  ASSERT_NE(out, nullptr);
  gzwrite(out, text.data(), static_cast<unsigned>(text.size()));
  gzclose(out);
  EXPECT_EQ(read_rinex_observations(packed).epochs.at(0).signals.at(0).pseudorange_m, 20604864.859);

  std::filesystem::resize_file(packed, std::filesystem::file_size(packed) / 2);
  EXPECT_THAT(error_of([&] { (void)read_rinex_observations(packed); }).what(),
              HasSubstr("no END OF HEADER; the file is cut short"));
  EXPECT_THAT(error_of([&] { (void)read_rinex_observations(folder.path()); }).what(),
              HasSubstr("is a folder"));
  EXPECT_THAT(error_of([&] { (void)read_rinex_observations(folder.path() / "none.obs"); }).what(),
              HasSubstr("none.obs: no such file"));
  const auto empty = folder.write("empty.obs", test::observations3());
  EXPECT_THAT(error_of([&] { (void)read_rinex_observations(empty); }).what(),
              HasSubstr("has no L1-band observation of a wanted system"));
}

// For any bytes, the reader returns epochs or one InputError.
TEST(RinexObservation, SeededDamage) {
  const std::string satellite2 = field(1e8) + blank_field() + field(2e7) + "\n" + field(-10) + "\n";
  std::string three = test::observations3(), two = test::observations2();
  for (int i = 0; i < 10; ++i) {
    three += epoch3(10 + i, 2) + kG05 + "R10" + field(2e7) + "\n";
    two += fmt::format(" 19  4 28 12 44 {}.0000000  0  1G 5\n", 10 + i) + satellite2;
  }
  std::mt19937 random(7);
  std::size_t epochs = 0, errors = 0;
  for (int round = 0; round < 2000; ++round) {
    std::string text = round % 2 == 0 ? three : two;
    for (int k = 0; k < 1 + round % 5; ++k) {
      const std::size_t at = random() % text.size();
      if (round % 3 == 0) {
        text[at] = static_cast<char>(random() % 256);
      } else if (round % 3 == 1) {
        text.erase(at, random() % 100);
      } else {
        text.insert(at, text.substr(random() % text.size(), random() % 100));
      }
    }
    try {
      epochs += read(text).epochs.size();
    } catch (const InputError&) {
      ++errors;
    }
  }
  EXPECT_GT(epochs, 10000U);
  EXPECT_GT(errors, 50U);
}

// Counted with: awk '/^>/{n++} h&&/^[GC]/{s[substr($0,1,1)]++} /END OF HEADER/{h=1} END{print
// n,s["G"],s["C"]}'
TEST(RinexObservation, RecordedDrive) {
  CANYON_SHARED_DATA(path, "urbannav-tst-20190428/COM3_190428_124409.obs");
  const auto file = read_rinex_observations(path);
  EXPECT_EQ(file.epochs.size(), 1760U);
  EXPECT_EQ(file.report.flags[0], 1760U);
  EXPECT_EQ(file.report.notes.losses(), 0U);
  std::map<System, std::size_t> count;
  for (const auto& epoch : file.epochs) {
    for (const auto& signal : epoch.signals) ++count[signal.id.system];
  }
  EXPECT_THAT(count, ElementsAre(testing::Pair(System::GPS, 11811U), testing::Pair(System::BeiDou, 14335U)));
  EXPECT_EQ(file.header.last, gps(13, 13, 53, 1'000'000));
  // Read from the file: its first epoch's G02, and the first of 12:52:26.003, C03.
  const auto& g02 = file.epochs[0].signals.at(0);
  EXPECT_EQ(file.epochs[0].receiver_time, gps(12, 44, 33, 997'000'000));
  EXPECT_EQ(g02.id, (SatelliteId{System::GPS, 2}));
  EXPECT_EQ(g02.pseudorange_m, 21600712.022);
  EXPECT_EQ(g02.carrier_phase_cycles, 113512506.876);
  EXPECT_EQ(g02.loss_of_lock, 3);
  EXPECT_EQ(g02.doppler_hz, 445.146);
  EXPECT_EQ(g02.cn0_dbhz, 27);
  const auto at = std::find_if(file.epochs.begin(), file.epochs.end(), [](const ObservationEpoch& e) {
    return e.receiver_time == gps(12, 52, 26, 3'000'000);
  });
  ASSERT_NE(at, file.epochs.end());
  ASSERT_THAT(at->signals, SizeIs(16));
  EXPECT_EQ(at->signals[0].id, (SatelliteId{System::BeiDou, 3}));
  EXPECT_EQ(at->signals[0].pseudorange_m, 37139987.386);
  EXPECT_EQ(at->signals[0].loss_of_lock, 2);
  EXPECT_EQ(at->signals[1].carrier_phase_cycles, std::nullopt);
  EXPECT_EQ(at->signals[1].loss_of_lock, 3);
}

}  // namespace
}  // namespace canyon::rinex
