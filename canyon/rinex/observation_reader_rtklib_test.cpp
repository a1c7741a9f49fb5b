// RTKLIB 2.4.3 b34 reads the same files: every value of every observation.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "canyon/rinex/observation_reader.hpp"
#include "tests/support/observation_text.hpp"
#include "tests/support/program.hpp"
#include "tests/support/rtklib_observations.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::rinex {
namespace {

/// Compares all observations of a file; the number compared.
std::size_t compare(const std::filesystem::path& path) {
  test::RtklibObservations theirs{};
  EXPECT_EQ(readrnx(path.c_str(), 1, "", &theirs, nullptr, nullptr), 1);
  std::map<std::pair<std::int64_t, int>, const test::RtklibObservation*> index;
  for (int i = 0; i < theirs.n; ++i) {
    const test::RtklibObservation& o = theirs.data[i];
    index[{test::gps_time(o.time).nanoseconds(), o.sat}] = &o;
  }
  const auto ours = read_rinex_observations(path);
  EXPECT_EQ(ours.report.damaged, 0U);
  std::size_t compared = 0;
  for (const ObservationEpoch& epoch : ours.epochs) {
    for (const ObservedSignal& s : epoch.signals) {
      const auto at = index.find({epoch.receiver_time.nanoseconds(), test::rtklib_satellite(s.id)});
      if (at == index.end()) {
        ADD_FAILURE() << gnss::to_string(s.id) << " of line " << epoch.line << " is not RTKLIB's";
        continue;
      }
      const test::RtklibObservation& o = *at->second;
      EXPECT_EQ(s.pseudorange_m.value_or(0), o.range[0]);
      EXPECT_EQ(s.carrier_phase_cycles.value_or(0), o.phase[0]);
      EXPECT_EQ(static_cast<float>(s.doppler_hz.value_or(0)), o.doppler[0]);
      EXPECT_NEAR(s.cn0_dbhz.value_or(0), 0.001 * o.snr[0], 0.00051);
      // RTKLIB drops the indicator of a phase that is missing.
      if (s.carrier_phase_cycles) {
        EXPECT_EQ(s.loss_of_lock & 3, o.lli[0] & 3);
      }
      ++compared;
    }
  }
  EXPECT_EQ(compared, index.size());
  std::free(theirs.data);
  return compared;
}

TEST(RinexObservationBesideRtklib, RecordedDrive) {
  CANYON_SHARED_DATA(path, "urbannav-tst-20190428/COM3_190428_124409.obs");
  EXPECT_EQ(compare(path), 26146U);
}

TEST(RinexObservationBesideRtklib, Version2) {
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
    EXPECT_EQ(compare(folder.write("two.19o", text)), 4 * n);
  }
}

// RTKLIB's converter writes the recorded drive in other versions: the values come back. 2.11 has no
// BeiDou, 2.12 names types anew, 3.02 calls BeiDou's band 1.
TEST(RinexObservationBesideRtklib, VersionsThatConvbinWrites) {
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
    EXPECT_EQ(file.report.damaged, 0U) << expected.version;
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
