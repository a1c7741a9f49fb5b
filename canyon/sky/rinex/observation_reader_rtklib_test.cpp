// RTKLIB 2.4.3 b34 reads the same files: every value of every observation.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <set>
#include <tuple>

#include "canyon/sky/gnss/signals.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"
#include "tests/support/observation_text.hpp"
#include "tests/support/program.hpp"
#include "tests/support/rtklib_observations.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::rinex {
namespace {

TEST(RinexObservationAndRtklib, RecordedDrive) {
  CANYON_SHARED_DATA(path, "urbannav-tst-20190428/COM3_190428_124409.obs");
  EXPECT_EQ(test::expect_as_rtklib(path), 26146U);
}

TEST(RinexObservationAndRtklib, Version2) {
  const simulation::test::TemporaryFolder folder;
  for (const std::string time_system : {"GPS", "GLO"}) {
    std::string text = test::observations2(time_system);
    std::string names;
    std::size_t n = 0;
    for (const char letter : {'G', 'R', 'E'}) {
      for (int k = 1; k <= 9; ++k, ++n) names += fmt::format("{}{:2d}", letter, k);
    }
    for (int second = 34; second < 38; ++second) {
      text += fmt::format(" 19  4 28 12 44 {}.{}000000  0 {}", second, second % 2 == 0 ? 0 : 5, n);
      for (std::size_t i = 0; i < n; ++i) {
        if (i > 0 && i % 12 == 0) text += "\n" + std::string(32, ' ');
        text += names.substr(3 * i, 3);
      }
      text += "\n";
      for (std::size_t i = 0; i < n; ++i) {
        const double v = 1000.0 * second + static_cast<double>(i);
        text += test::field(1e8 + v, i % 5 == 0 ? '1' : ' ') + test::blank_field() + test::field(2e7 + v) +
                test::blank_field() + test::blank_field() + "\n";
        text += test::field(-v / 100) + test::blank_field() + test::field(30 + second / 4.0) + "\n";
      }
    }
    EXPECT_EQ(test::expect_as_rtklib(folder.write("two.19o", text)), 4 * n);
  }
}

/// A file of version 3.04 with every signal of every system, ten epochs.
/// @param only_recorded with signals that are only in recordings: P(Y) shares a band, and in version 2 its
/// phase, with L2C
std::string every_signal(bool only_recorded = true) {
  const auto signals_of = [&](gnss::System system) {
    const auto all = gnss::signals_of(system);
    const auto kept = std::count_if(all.begin(), all.end(), [&](const gnss::Signal& signal) {
      return only_recorded || signal.only_recorded.empty();
    });
    return all.first(static_cast<std::size_t>(kept));  // the others are last
  };
  std::string text =
      test::header_line("     3.04           OBSERVATION DATA    M: MIXED", "RINEX VERSION / TYPE");
  for (const gnss::System system : gnss::kAllSystems) {
    std::string types;
    std::size_t count = 0;
    for (const gnss::Signal& signal : signals_of(system)) {
      for (const char kind : std::string_view("CLDS")) {
        if (count > 0 && count % 13 == 0) {
          text += test::header_line(types, "SYS / # / OBS TYPES");
          types.clear();
        }
        if (types.empty()) {
          types = count > 0 ? std::string(6, ' ')
                            : fmt::format("{}  {:3d}", gnss::letter(system), 4 * signals_of(system).size());
        }
        types += fmt::format(" {}{}", kind, signal.code);
        ++count;
      }
    }
    text += test::header_line(types, "SYS / # / OBS TYPES");
  }
  text += test::header_line("  2019     4    28    12    44   30.0000000     GPS", "TIME OF FIRST OBS") +
          test::header_line("", "END OF HEADER");
  for (int second = 30; second < 40; ++second) {
    text += fmt::format("> 2019 04 28 12 44 {}.0000000  0{:3d}\n", second, 2 * gnss::kSystemCount);
    for (const gnss::System system : gnss::kAllSystems) {
      for (int number : {2, 7}) {
        if (system == gnss::System::SBAS) number += 20;
        text += fmt::format("{}{:02d}", gnss::letter(system), number);
        double v = 1000.0 * second + number;
        for (std::size_t k = 0; k < signals_of(system).size(); ++k, v += 0.125) {
          // The phases of one are missing, lock is lost occasionally.
          const bool phase = (static_cast<std::size_t>(second) + k) % 5 != 0;
          text += test::field(2e7 + v) +
                  (phase ? test::field(1e8 + v, second % 4 == 0 ? '1' : ' ') : test::blank_field()) +
                  test::field(-v / 100) + test::field(30 + static_cast<double>(k) / 4);
        }
        text += "\n";
      }
    }
  }
  return text;
}

TEST(RinexObservationAndRtklib, EverySignal) {
  const simulation::test::TemporaryFolder folder;
  ObservationOptions all;
  all.all_signals = true;
  std::size_t signals = 0;
  for (const gnss::System system : gnss::kAllSystems) signals += gnss::signals_of(system).size();
  EXPECT_EQ(test::expect_as_rtklib(folder.write("every.obs", every_signal()), all), 10 * 2 * signals);
}

// Versions 2 written by RTKLIB's converter name bands, not codes: the values are equal.
TEST(RinexObservationAndRtklib, EverySignalInVersion2) {
  CANYON_NEEDS_PROGRAM("convbin");
  const simulation::test::TemporaryFolder folder;
  ObservationOptions all;
  all.all_signals = true;
  const auto path = folder.write("every.obs", every_signal(false));
  using Key = std::tuple<geodesy::GpsTime, gnss::SatelliteId, const gnss::Signal*>;
  std::map<Key, ObservedSignal> original;
  for (const ObservationEpoch& e : read_rinex_observations(path, all).epochs) {
    for (const ObservedSignal& s : e.signals) original[{e.receiver_time, s.id, s.signal}] = s;
  }
  for (const std::string version : {"2.11", "2.12"}) {
    const auto converted = folder.path() / ("converted." + version);
    ASSERT_EQ(test::run_program("convbin -r rinex -od -os -f 5 -v " + version + " -o '" + converted.string() +
                                "' '" + path.string() + "' 2>/dev/null")
                  .status,
              0);
    const auto file = read_rinex_observations(converted, all);
    EXPECT_EQ(file.report.notes.losses(), 0U);
    std::map<std::string, std::size_t> count;
    for (const ObservationEpoch& e : file.epochs) {
      for (const ObservedSignal& s : e.signals) {
        const auto at = original.find({e.receiver_time, s.id, s.signal});
        ASSERT_NE(at, original.end());
        EXPECT_EQ(s.pseudorange_m, at->second.pseudorange_m) << version << ' ' << s.signal->name;
        EXPECT_EQ(s.carrier_phase_cycles, at->second.carrier_phase_cycles) << version << s.signal->name;
        EXPECT_EQ(s.doppler_hz, at->second.doppler_hz) << version << s.signal->name;
        EXPECT_EQ(s.cn0_dbhz, at->second.cn0_dbhz) << version << s.signal->name;
        ++count[std::string(gnss::name(s.id.system)) + " " + std::string(s.signal->name)];
      }
    }
    // 2.11 has no BeiDou, and fields for only one of the signals near L1.
    std::set<std::string> names{"GPS L1CA",   "GPS L2C",     "GPS L5",      "GLONASS G1", "GLONASS G2",
                                "Galileo E1", "Galileo E5a", "Galileo E5b", "SBAS L1CA"};
    if (version == "2.12") names.insert({"GPS L1C", "BeiDou B1I", "BeiDou B2I", "BeiDou B3I"});
    EXPECT_EQ(count.size(), names.size()) << version;
    for (const std::string& name : names) EXPECT_EQ(count[name], 20U) << version << ' ' << name;
  }
}

// RTKLIB's converter writes the recorded drive in other versions: the values are equal. 2.11 has no BeiDou,
// 2.12 has new type names, 3.02 calls BeiDou's band 1.
TEST(RinexObservationAndRtklib, VersionsThatConvbinWrites) {
  CANYON_SHARED_DATA(path, "urbannav-tst-20190428/COM3_190428_124409.obs");
  CANYON_NEEDS_PROGRAM("convbin");
  using Key = std::pair<geodesy::GpsTime, gnss::SatelliteId>;
  const auto by_key = [](const RinexObservations& file) {
    std::map<Key, ObservedSignal> result;
    for (const ObservationEpoch& e : file.epochs) {
      for (const ObservedSignal& s : e.signals) result[{e.receiver_time, s.id}] = s;
    }
    return result;
  };
  const auto original = by_key(read_rinex_observations(path));
  const simulation::test::TemporaryFolder folder;
  struct Expected {
    std::string version;
    std::size_t count;
    std::string gps_code, beidou_code;
  };
  for (const Expected& expected :
       {Expected{"2.11", 11811, "1C", ""}, Expected{"2.12", 26146, "1C", "2I"},
        Expected{"3.02", 26146, "1C", "1I"}, Expected{"3.04", 26146, "1C", "2I"}}) {
    const auto converted = folder.path() / ("converted." + expected.version);
    ASSERT_EQ(test::run_program("convbin -r rinex -od -os -v " + expected.version + " -o '" +
                                converted.string() + "' '" + path.string() + "' 2>/dev/null")
                  .status,
              0);
    const auto file = read_rinex_observations(converted);
    EXPECT_EQ(file.report.notes.losses(), 0U) << expected.version;
    const auto values = by_key(file);
    EXPECT_EQ(values.size(), expected.count) << expected.version;
    for (const auto& [key, signal] : values) {
      const auto at = original.find(key);
      ASSERT_NE(at, original.end()) << expected.version;
      const ObservedSignal& o = at->second;
      ASSERT_EQ(signal.pseudorange_m, o.pseudorange_m) << expected.version;
      ASSERT_EQ(signal.carrier_phase_cycles, o.carrier_phase_cycles) << expected.version;
      ASSERT_EQ(signal.doppler_hz, o.doppler_hz) << expected.version;
      ASSERT_EQ(signal.cn0_dbhz, o.cn0_dbhz) << expected.version;
      const bool gps = key.second.system == gnss::System::GPS;
      ASSERT_EQ(std::string(signal.code.data()), gps ? expected.gps_code : expected.beidou_code);
    }
  }
}

}  // namespace
}  // namespace canyon::rinex
