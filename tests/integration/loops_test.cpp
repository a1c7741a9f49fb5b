// Loops and clocks of receivers over hours and drives, as run in scenarios.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/integration/run_scenario.hpp"

namespace canyon {
namespace {

using propagation::Visibility;

/// All epochs of each receiver.
std::vector<std::vector<receiver::ReceiverEpoch>> run(const std::string& yaml) {
  const test::TemporaryFolder folder;
  const simulation::Simulation simulation = test::prepare(yaml, folder.path());
  test::Recorder recorder;
  simulation.run({&recorder}, {});
  std::vector<std::vector<receiver::ReceiverEpoch>> result(simulation.scenario().receivers.size());
  for (const simulation::Epoch& epoch : recorder.epochs) result[epoch.receiver].push_back(epoch.observed);
  return result;
}

// A loop that tracks an echo while a building blocks the direct signal remained on a side peak of the
// correlation when the direct signal returned: 8 to 15 % of these epochs were then off by 50 m and more, for
// hours.
TEST(CodeLoops, DoNotRestOnSidePeaksOfADayInAStreet) {
  const auto receivers = run(R"(
city:
  synthetic: {seed: 11}
  facades: {mix: as_given}   # coated glass makes echoes stronger than shadowed direct signals: no fault of loops
  origin: {latitude_deg: 55.75, longitude_deg: 37.62, height_m: 150}
sky: {nominal: true, systems: [GPS, Galileo]}
start: 2026-06-01T00:00:00Z
rate_hz: 0.05
duration_s: 43200
trajectory:
  position: {east_m: -38, north_m: 0, up_m: 1.5}
receivers:
  - {name: one, profile: ublox-m8t, independent_noise: true}
  - {name: another, profile: ublox-m8t, independent_noise: true}
  - {name: f9p, profile: ublox-f9p, independent_noise: true}
  - {name: survey, profile: survey, independent_noise: true}
seed: 1
)");
  struct Count {
    int tracked = 0, off = 0;
  };
  std::map<std::pair<std::size_t, gnss::System>, Count> counts;
  for (std::size_t r = 0; r < receivers.size(); ++r) {
    for (const receiver::ReceiverEpoch& epoch : receivers[r]) {
      for (const receiver::SatelliteObservation& seen : epoch.satellites) {
        const bool direct = seen.visibility == Visibility::LOS || seen.visibility == Visibility::LOSMultipath;
        if (!direct || seen.lock != tracking::LockState::Tracking) continue;
        Count& count = counts[{r, seen.id.system}];
        ++count.tracked;
        count.off += std::abs(seen.excess_m) >= 50;
      }
    }
  }
  ASSERT_EQ(counts.size(), 8U);
  for (const auto& [key, count] : counts) {
    std::cout << key.first << ' ' << gnss::name(key.second) << ": " << count.off << " of " << count.tracked
              << '\n';
    EXPECT_GT(count.tracked, 5000);
    EXPECT_LT(count.off, 0.005 * count.tracked) << key.first << ' ' << gnss::name(key.second);
  }
}

// A drive's code delays at the same instants, with rates of 1, 5 and 20 Hz.
TEST(CodeLoops, TellTheSameAtEveryRateOfEpochs) {
  const auto drive = [](double rate_hz) {
    return run(fmt::format(R"(
city: {{facades: {{mix: as_given}}, synthetic: {{blocks_east: 4, blocks_north: 4, seed: 5}}}}
sky: {{nominal: true, systems: [GPS, Galileo]}}
start: 2026-03-01T10:00:00Z
trajectory:
  waypoints: [{{east_m: -152, north_m: 0}}, {{east_m: 152, north_m: 0}}]
  speed_mps: 8
  height_above_terrain_m: 1.5
rate_hz: {}
receivers: [{{name: rover, profile: ublox-m8t, signal: {{shadowing: {{enabled: false}}, dll: {{loop_bandwidth_hz: 1}}}}}}]
propagation: {{diffuse: {{enabled: false}}, diffraction: {{enabled: false}}}}
)",
                           rate_hz))
        .front();
  };
  const std::vector<receiver::ReceiverEpoch> slow = drive(1);
  for (const int rate : {5, 20}) {
    const std::vector<receiver::ReceiverEpoch> fast = drive(rate);
    int compared = 0, apart = 0;
    double square_slow = 0, square_fast = 0, largest_step_m = 0;
    for (std::size_t i = 0; i < fast.size(); ++i) {
      for (const receiver::SatelliteObservation& now : fast[i].satellites) {
        if (now.lock != tracking::LockState::Tracking) continue;
        if (i > 0) {
          for (const receiver::SatelliteObservation& before : fast[i - 1].satellites) {
            if (before.id == now.id && before.lock == now.lock && before.measurement && now.measurement &&
                before.measurement->phase_since && now.measurement->phase_since &&
                *before.measurement->phase_since == *now.measurement->phase_since) {
              largest_step_m = std::max(largest_step_m, std::abs(now.excess_m - before.excess_m));
            }
          }
        }
        if (i % static_cast<std::size_t>(rate) != 0) continue;
        for (const receiver::SatelliteObservation& other :
             slow[i / static_cast<std::size_t>(rate)].satellites) {
          if (other.id != now.id || other.lock != now.lock) continue;
          ++compared;
          apart += std::abs(other.excess_m - now.excess_m) > 5;
          square_slow += std::min(1e3, other.excess_m * other.excess_m);
          square_fast += std::min(1e3, now.excess_m * now.excess_m);
        }
      }
    }
    std::cout << rate << " Hz: " << compared << " compared, " << apart << " apart, largest step "
              << largest_step_m << " m\n";
    EXPECT_GT(compared, 300);
    // Within a second a car passes paths that are missed at a slow rate.
    EXPECT_LT(apart, 0.1 * compared) << rate;
    EXPECT_NEAR(std::sqrt(square_fast / square_slow), 1, 0.1) << rate;
    // A loop of 1 Hz pulls in by half a chip, of BPSK(1), at most four times per second.
    EXPECT_LT(largest_step_m, 4 * 147.0 / rate) << rate;
  }
}

// The ionosphere of nominal satellites is the standard one; phase, code and Doppler contain its rate and that
// of the troposphere.
TEST(Doppler, IsTheRateOfTheCarrierThroughTheAtmosphere) {
  const std::vector<receiver::ReceiverEpoch> epochs = run(R"(
city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}
sky: {nominal: true, systems: [GPS], errors: {enabled: false}}
start: 2026-03-01T10:00:00Z
trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}
duration_s: 600
rate_hz: 1
receivers:
  - name: rover
    profile: survey
    elevation_mask_deg: 5
    ionosphere: true
    troposphere: true
    clock: {drift_walk: 0}
    noise: {enabled: false}
    signal: {loop_noise: false, shadowing: {enabled: false}}
propagation: {ground_reflection: false, diffuse: {enabled: false}}
)")
                                                          .front();
  int compared = 0;
  double worst_low_mps = 0, ionosphere_mps = 0;
  for (std::size_t i = 1; i + 1 < epochs.size(); ++i) {
    for (const receiver::SatelliteObservation& now : epochs[i].satellites) {
      if (!now.measurement || !now.measurement->carrier_phase_cycles) continue;
      const positioning::Measurement* around[2] = {nullptr, nullptr};
      for (const std::size_t k : {i - 1, i + 1}) {
        for (const receiver::SatelliteObservation& other : epochs[k].satellites) {
          if (other.id == now.id && other.measurement && other.measurement->carrier_phase_cycles &&
              *other.measurement->phase_since == *now.measurement->phase_since) {
            around[k > i] = &*other.measurement;
          }
        }
      }
      if (around[0] == nullptr || around[1] == nullptr) continue;
      const double wavelength = geodesy::kSpeedOfLight / now.measurement->carrier_frequency_hz;
      const double phase_mps =
          wavelength * (*around[1]->carrier_phase_cycles - *around[0]->carrier_phase_cycles) / 2;
      const double code_mps = (around[1]->pseudorange_m - around[0]->pseudorange_m) / 2;
      const double doppler_mps = -wavelength * *now.measurement->doppler_hz;
      // Central differences over 2 s: r''' / 6 of a satellite is some 1e-5 m/s.
      worst_low_mps = std::max(worst_low_mps, std::abs(phase_mps - doppler_mps));
      // Code minus carrier: twice the ionosphere's rate.
      ionosphere_mps = std::max(ionosphere_mps, std::abs(code_mps - phase_mps) / 2);
      ++compared;
    }
  }
  EXPECT_GT(compared, 3000);
  EXPECT_LT(worst_low_mps, 1e-3);
  EXPECT_GT(ionosphere_mps, 5e-4);
  EXPECT_LT(ionosphere_mps, 1e-2);
}

// Receivers that differ in a setting have the same noise realization; independent_noise makes it independent.
TEST(Samples, AreOfSeedAndSatelliteUnlessAskedOtherwise) {
  const auto receivers = run(R"(
city: {synthetic: {blocks_east: 4, blocks_north: 4, seed: 5}}
sky: {nominal: true, systems: [GPS]}
start: 2026-03-01T10:00:00Z
trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}
duration_s: 30
rate_hz: 1
receivers:
  - {name: a, profile: ublox-m8t, independent_noise: false}
  - {name: b, profile: ublox-m8t, min_satellites: 5, independent_noise: false}
  - {name: c, profile: ublox-m8t}
)");
  double apart = 0;
  for (std::size_t k = 0; k < receivers[0].size(); ++k) {
    const receiver::ReceiverEpoch &a = receivers[0][k], &b = receivers[1][k], &c = receivers[2][k];
    EXPECT_EQ(a.clock_bias_s, b.clock_bias_s);
    ASSERT_EQ(a.satellites.size(), b.satellites.size());
    for (std::size_t i = 0; i < a.satellites.size(); ++i) {
      EXPECT_EQ(a.satellites[i].noise_m, b.satellites[i].noise_m);
      EXPECT_EQ(a.satellites[i].cn0_dbhz, b.satellites[i].cn0_dbhz);
      apart += std::abs(a.satellites[i].noise_m - c.satellites[i].noise_m);
    }
  }
  EXPECT_GT(apart, 1);
}

}  // namespace
}  // namespace canyon
