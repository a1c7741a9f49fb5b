// RTKLIB 2.4.3 b34 reads the same files: every value of every observation.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "canyon/validation/rinex_observation.hpp"
#include "tests/support/observation_text.hpp"
#include "tests/support/rtklib_observations.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/simulation_support.hpp"

// RTKLIB leaves these to the program that it is linked into.
extern "C" {
int showmsg(const char*, ...) {
  return 0;
}
void settspan(RtklibTime, RtklibTime) {}
void settime(RtklibTime) {}
}

namespace canyon::validation {
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
        ADD_FAILURE() << orbit::to_string(s.id) << " of line " << epoch.line << " is not RTKLIB's";
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

}  // namespace
}  // namespace canyon::validation
