// A receiver's signals, written as RINEX and read back by the reader of recordings.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>

#include "canyon/analysis/validation/statistics.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/loaded_city.hpp"
#include "tests/support/sample_signals.hpp"
#include "tests/support/source_dir.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon {
namespace {

TEST(SignalFiles, ObservationsComeBack) {
  const test::TemporaryFolder folder;
  encoding::ReceiverDescription header;
  header.name = "rover";
  header.systems = {gnss::kAllSystems.begin(), gnss::kAllSystems.end()};
  header.signal.enabled = true;
  const geodesy::GpsTime begin = test::sample_time();
  std::vector<simulation::Epoch> epochs;
  for (int i = 0; i < 3; ++i) {
    // R24's phase is lost between the second epoch and the third.
    epochs.push_back(test::sample_signal_epoch(begin + i, begin - 5));
    if (i == 2) epochs.back().observed.satellites[6].measurement->phase_since = begin + 1.5;
  }
  const auto sink = encoding::open_file("rinex_observation", folder / "rover.obs", 0, header);
  for (const auto& epoch : epochs) sink->write(epoch);
  sink->finish();

  const auto file = rinex::read_rinex_observations(folder / "rover.obs");
  EXPECT_EQ(file.report.notes.losses(), 0U);
  ASSERT_EQ(file.epochs.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    const receiver::ReceiverEpoch& seen = epochs[i].observed;
    EXPECT_LE(std::abs(file.epochs[i].receiver_time - seen.receiver_time), 50.1e-9);
    std::map<gnss::SatelliteId, rinex::ObservedSignal> read;
    for (const auto& signal : file.epochs[i].signals) read[signal.id] = signal;
    EXPECT_EQ(read.size(), 10U);
    for (const auto& satellite : seen.satellites) {
      ASSERT_EQ(read.count(satellite.id), satellite.measurement ? 1U : 0U);
      if (!satellite.measurement) continue;
      const positioning::Measurement& m = *satellite.measurement;
      const rinex::ObservedSignal& s = read[satellite.id];
      EXPECT_EQ(std::string_view(s.code.data()), gnss::signals_of(satellite.id.system).front().code);
      EXPECT_NEAR(s.pseudorange_m.value(), m.pseudorange_m, 0.6e-3);
      EXPECT_NEAR(s.doppler_hz.value(), *m.doppler_hz, 0.6e-3);
      EXPECT_NEAR(s.cn0_dbhz.value(), *m.cn0_dbhz, 0.6e-3);
      EXPECT_FALSE(s.cn0_from_indicator);
      ASSERT_EQ(s.carrier_phase_cycles.has_value(), m.carrier_phase_cycles.has_value());
      const bool slipped = gnss::to_string(satellite.id) == "R24" && i == 2;
      EXPECT_EQ(s.loss_of_lock, slipped ? 1 : 0) << gnss::to_string(satellite.id) << " at " << i;
      if (!s.carrier_phase_cycles) continue;
      // The phase equals the pseudorange, to half a cycle at the beginning of an arc; the sample's phases are
      // constant.
      EXPECT_NEAR(*s.carrier_phase_cycles, *s.pseudorange_m * m.carrier_frequency_hz / geodesy::kSpeedOfLight,
                  0.51);
    }
  }
}

/// A drive among buildings with the receiver's signal model and no noise, two epochs per second.
simulation::Simulation strong_and_weak_drive() {
  const std::filesystem::path path =
      std::filesystem::path(canyon_source_dir) / "examples/synthetic_drive.yaml";
  simulation::Scenario scenario = simulation::parse_scenario(std::string(TextFile(path).text()), path);
  scenario.duration_s = 60;
  scenario.rate_hz = 2;
  scenario.outputs = {};
  scenario.outputs.names.erase("pictures");
  scenario.receivers.assign(1, {});
  receiver::ReceiverOptions& options = scenario.receivers[0].options;
  options.noise.enabled = false;
  options.signal.enabled = true;
  options.signal.loop_noise = false;
  options.signal.lock.warm_start = true;
  city::City city = test::loaded_city(scenario.city);
  return simulation::Simulation(std::move(scenario), std::move(city));
}

TEST(SignalFiles, PhaseOfADriveFollowsItsDoppler) {
  const simulation::Simulation simulation = strong_and_weak_drive();
  const test::TemporaryFolder folder;
  const auto epochs = test::run_and_write(simulation, folder.path());
  const auto file = rinex::read_rinex_observations(folder / "receiver.obs");
  EXPECT_EQ(file.report.notes.losses(), 0U);
  ASSERT_EQ(file.epochs.size(), epochs.size());
  struct Last {
    geodesy::GpsTime tag;
    rinex::ObservedSignal signal;
  };
  std::map<gnss::SatelliteId, Last> last;
  std::size_t slips = 0;
  std::vector<double> apart;  // of the phase's and the Doppler's steps [cycles]
  std::vector<double> los_cn0, nlos_cn0;
  for (std::size_t i = 0; i < epochs.size(); ++i) {
    std::map<gnss::SatelliteId, const receiver::SatelliteObservation*> truth;
    for (const auto& s : epochs[i].observed.satellites) truth[s.id] = &s;
    for (const rinex::ObservedSignal& s : file.epochs[i].signals) {
      ASSERT_EQ(truth.count(s.id), 1U);
      const bool nlos = truth[s.id]->visibility == propagation::Visibility::NLOS;
      (nlos ? nlos_cn0 : los_cn0).push_back(s.cn0_dbhz.value());
      if (!s.carrier_phase_cycles) continue;
      const geodesy::GpsTime tag = file.epochs[i].receiver_time;
      const auto before = last.find(s.id);
      if (before != last.end()) {
        const bool lost = (s.loss_of_lock & 1) != 0;
        slips += lost ? 1 : 0;
        if (!lost && tag - before->second.tag < 0.75 &&
            truth[s.id]->visibility == propagation::Visibility::LOS) {
          // RINEX 3.04, 3.3: the phase decreases if the Doppler is positive. The mean of both ends' Doppler
          // is the mean over the interval, except for the change of acceleration.
          const double moved = *s.carrier_phase_cycles - *before->second.signal.carrier_phase_cycles;
          const double expected =
              -0.5 * (*s.doppler_hz + *before->second.signal.doppler_hz) * (tag - before->second.tag);
          apart.push_back(std::abs(moved - expected));
        }
      }
      last[s.id] = {tag, s};
    }
  }
  const auto at = [](std::vector<double>& values, double fraction) {
    return quantile(values, fraction).value();
  };
  std::printf(
      "%zu steps of phase differ from the Doppler's by %.2g cycles in the median, %.2g in nine of ten\n",
      apart.size(), at(apart, 0.5), at(apart, 0.9));
  std::printf("%zu slips; C/N0 in the median: %.1f dB-Hz of %zu LOS, %.1f of %zu NLOS\n", slips,
              at(los_cn0, 0.5), los_cn0.size(), at(nlos_cn0, 0.5), nlos_cn0.size());
  EXPECT_GT(apart.size(), 200U);
  // Both are written to thousandths; the phase's curvature in 0.5 s of a car's drive is smaller.
  EXPECT_LT(at(apart, 0.5), 1e-3);
  EXPECT_LT(at(apart, 0.9), 2e-3);
  EXPECT_GT(slips, 10U) << "signals come and go among the buildings";
  EXPECT_GT(at(los_cn0, 0.5), at(nlos_cn0, 0.5) + 3) << "a reflection loses some";
}

}  // namespace
}  // namespace canyon
