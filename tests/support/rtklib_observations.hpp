#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string_view>
#include <utility>

#include "canyon/sky/rinex/observation_reader.hpp"
#include "tests/support/rtklib.hpp"

namespace canyon::test {

/// obsd_t of Debian's build of RTKLIB 2.4.3 b34, which stores eight frequencies. Its tests would fail with a
/// wrong layout.
struct RtklibObservation {
  RtklibTime time;
  unsigned char sat, rcv;
  std::uint16_t snr[8];  ///< [0.001 dB-Hz]
  unsigned char lli[8], code[8];
  double phase[8], range[8];
  float doppler[8];
};
static_assert(sizeof(RtklibObservation) == 216);

/// obs_t; `data` is allocated by malloc().
struct RtklibObservations {
  int n, nmax;
  RtklibObservation* data;
};

extern "C" char* code2obs(unsigned char code);  ///< "1C"; "" of none

/// Also reads an observation file with RTKLIB: both must have the same values. Compares RTKLIB's first
/// frequency of each satellite; with ObservationOptions::all_signals (versions 3 and 4) those of the same
/// code. Returns the number of signals compared.
inline std::size_t expect_as_rtklib(const std::filesystem::path& path,
                                    const rinex::ObservationOptions& options = {}) {
  RtklibObservations theirs{};
  EXPECT_EQ(readrnx(path.c_str(), 1, "", &theirs, nullptr, nullptr), 1);
  std::map<std::pair<std::int64_t, int>, const RtklibObservation*> index;
  std::size_t expected = 0;
  for (int i = 0; i < theirs.n; ++i) {
    const RtklibObservation& o = theirs.data[i];
    index[{gps_time(o.time).nanoseconds(), o.sat}] = &o;
    for (const double range : o.range) expected += options.all_signals && range != 0 ? 1 : 0;
  }
  if (!options.all_signals) expected = index.size();
  const auto ours = rinex::read_rinex_observations(path, options);
  EXPECT_EQ(ours.report.notes.losses(), 0U);
  std::size_t compared = 0;
  for (const rinex::ObservationEpoch& epoch : ours.epochs) {
    for (const rinex::ObservedSignal& s : epoch.signals) {
      const auto at = index.find({epoch.receiver_time.nanoseconds(), rtklib_satellite(s.id)});
      if (at == index.end()) {
        ADD_FAILURE() << gnss::to_string(s.id) << " of line " << epoch.line << " is not RTKLIB's";
        continue;
      }
      const RtklibObservation& o = *at->second;
      std::size_t k = 0;
      while (options.all_signals && k < 8 && std::string_view(code2obs(o.code[k])) != s.code.data()) ++k;
      if (k == 8) {
        ADD_FAILURE() << gnss::to_string(s.id) << ' ' << s.code.data() << " of line " << epoch.line
                      << " is not RTKLIB's";
        continue;
      }
      EXPECT_EQ(s.pseudorange_m.value_or(0), o.range[k]);
      EXPECT_EQ(s.carrier_phase_cycles.value_or(0), o.phase[k]);
      EXPECT_EQ(static_cast<float>(s.doppler_hz.value_or(0)), o.doppler[k]);
      EXPECT_NEAR(s.cn0_dbhz.value_or(0), 0.001 * o.snr[k], 0.00051);
      // RTKLIB drops the indicator of a missing phase.
      if (s.carrier_phase_cycles) {
        EXPECT_EQ(s.loss_of_lock & 3, o.lli[k] & 3);
      }
      ++compared;
    }
  }
  EXPECT_EQ(compared, expected);
  std::free(theirs.data);
  return compared;
}

}  // namespace canyon::test
