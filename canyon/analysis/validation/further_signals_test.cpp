// Recordings of several bands, emitted by Canyon's own receiver: the comparison recovers the simulated
// values.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "canyon/analysis/validation/metrics.hpp"
#include "canyon/analysis/validation/metrics_text.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/simulated_recording.hpp"

namespace canyon::validation {
namespace {

using test::SimulatedRecording;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

/// Two bands and three of each system, with the noise of all loops.
void three_bands(simulation::ReceiverConfig& receiver) {
  receiver.options.tracks = {"L1CA", "L2C", "L5", "E1", "E5a", "E5b"};
  receiver.options.signal.enabled = true;
  receiver.options.signal.antenna = signal::dual_patch_antenna();
  receiver.options.signal.lock.warm_start = true;
}

std::vector<std::string> names_of(const std::vector<const gnss::Signal*>& signals) {
  std::vector<std::string> names;
  for (const gnss::Signal* signal : signals) names.emplace_back(signal->name);
  return names;
}

ModelMetrics all_metrics(const Comparison& comparison) {
  MetricOptions options;
  options.resamples = 0;
  return metrics(comparison, 0, comparison.epochs.size(), "all", options);
}

Comparison compare_by(const SimulatedRecording& recorded, const Recording& recording, std::uint64_t seed,
                      const std::vector<std::string>& tracks = {}) {
  simulation::ReceiverConfig receiver = recorded.scenario().receivers.front();
  if (!tracks.empty()) receiver.options.tracks = tracks;
  return compare(recording, receiver, recorded.environment(), {}, seed);
}

/// Calls visit(epoch, satellite, signal) for every signal of the recorder's epochs that the comparison has.
template <typename Visit>
void each_recorded(const SimulatedRecording& recorded, const Comparison& comparison, Visit visit) {
  std::size_t next = 0;
  for (const simulation::Epoch& epoch : recorded.epochs()) {
    // Reception times are recovered within a microsecond.
    if (next == comparison.epochs.size() || comparison.epochs[next].time - epoch.observed.time > 0.1)
      continue;
    for (const receiver::SatelliteObservation& s : epoch.observed.satellites) {
      visit(next, s.id, static_cast<const receiver::SignalObservation&>(s));
      for (const receiver::SignalObservation& other : s.more) visit(next, s.id, other);
    }
    ++next;
  }
  EXPECT_EQ(next, comparison.epochs.size());
}

/// The deviation by PhaseView's estimator of normal values with many deviations: m / 0.6745 where
/// mean of erf(m / (s_i sqrt 2)) = 1/2.
double pooled_deviation(const std::vector<double>& sigmas) {
  double low = 0, high = *std::max_element(sigmas.begin(), sigmas.end());
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    double fraction = 0;
    for (const double s : sigmas) fraction += std::erf(middle / (s * std::sqrt(2.0)));
    (fraction < 0.5 * static_cast<double>(sigmas.size()) ? low : high) = middle;
  }
  return 1.4826 * low;
}

// Above the roofs, only the loops' noise is in a phase. Its deviation is the one of the PLL's formula in the
// receiver (Kaplan & Hegarty, tracking::pll_jitter_rad), including the file's thousandths of a cycle.
TEST(FurtherSignals, PhaseNoiseIsThatOfTheLoop) {
  const SimulatedRecording recorded({}, three_bands, "min_height_m: 1, max_height_m: 1.2");
  const Recording recording = recorded.read();
  const Comparison comparison = compare_by(recorded, recording, 2);
  std::map<const gnss::Signal*, std::vector<double>> sigmas;
  each_recorded(recorded, comparison, [&](std::size_t, gnss::SatelliteId, const auto& signal) {
    if (!signal.measurement || !signal.measurement->carrier_phase_cycles) return;
    const positioning::Measurement& m = *signal.measurement;
    const double rounding = 1e-3 / std::sqrt(12.0);
    sigmas[signal.signal].push_back(std::hypot(m.carrier_phase_sigma_cycles, rounding) *
                                    geodesy::kSpeedOfLight / m.carrier_frequency_hz);
  });
  const ModelMetrics f = all_metrics(comparison);
  ASSERT_EQ(f.signals.size(), 6U);
  for (const SignalMetrics& s : f.signals) {
    ASSERT_TRUE(s.judged());
    ASSERT_TRUE(s.phase.measured.los.noise_m && s.phase.simulated.los.noise_m) << s.name();
    const double expected = pooled_deviation(sigmas[s.signal]);
    const std::size_t n = s.phase.measured.los.noise_n;
    std::printf("%-12s %5zu third differences: %.3f mm recorded, %.3f simulated, %.3f by the loop\n",
                s.name().c_str(), n, 1e3 * *s.phase.measured.los.noise_m,
                1e3 * *s.phase.simulated.los.noise_m, 1e3 * expected);
    EXPECT_GT(n, 500U);
    // The median of n magnitudes scatters by 1.17 / sqrt(n); third differences overlap, n counts 2.3-fold
    // (1 + 2 (15^2 + 6^2 + 1) / 20^2).
    const double scatter = 1.17 * std::sqrt(2.3 / static_cast<double>(n));
    EXPECT_NEAR(*s.phase.measured.los.noise_m / expected, 1, 3.5 * scatter) << s.name();
    EXPECT_NEAR(*s.phase.simulated.los.noise_m / expected, 1, 3.5 * scatter) << s.name();
    EXPECT_EQ(s.phase.measured.slips, 0U) << s.name();
    EXPECT_EQ(s.phase.simulated.slips, 0U) << s.name();
    EXPECT_FALSE(s.phase.measured.time_between_slips_s());
    EXPECT_EQ(s.phase.measured.los.fraction(), 1.0) << s.name();
    EXPECT_EQ(s.tracked_los.ratio(Side::Measured).value(), 1) << s.name();
  }
}

// Among houses, compared with the same receiver under another seed: the same distributions, and the slips
// that the recording receiver had.
TEST(FurtherSignals, EmittedRecordingIsJudgedAsItsOwn) {
  const SimulatedRecording recorded({}, three_bands);
  const Recording recording = recorded.read();
  const Comparison comparison = compare_by(recorded, recording, 2);
  EXPECT_THAT(names_of(comparison.recorded), ElementsAre("L1CA", "L2C", "L5", "E1", "E5a", "E5b"));
  EXPECT_EQ(comparison.tracked, comparison.recorded);

  struct KnownSignal {
    std::size_t slips = 0, with_phase = 0, observations = 0;
  };
  std::map<const gnss::Signal*, KnownSignal> known;
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, geodesy::GpsTime> since;
  each_recorded(recorded, comparison, [&](std::size_t, gnss::SatelliteId id, const auto& signal) {
    if (!signal.measurement) return;
    KnownSignal& signal_entry = known[signal.signal];
    ++signal_entry.observations;
    if (!signal.measurement->carrier_phase_cycles) return;
    ++signal_entry.with_phase;
    const auto [at, first] = since.try_emplace({id, signal.signal}, *signal.measurement->phase_since);
    if (!first && at->second != *signal.measurement->phase_since) ++signal_entry.slips;
    at->second = *signal.measurement->phase_since;
  });

  const ModelMetrics f = all_metrics(comparison);
  ASSERT_EQ(f.signals.size(), 6U);
  for (const SignalMetrics& s : f.signals) {
    const KnownSignal& signal_entry = known[s.signal];
    const PhaseMetrics& phase = s.phase.measured;
    std::printf(
        "%-12s KS of errors %.3f %.3f, of C/N0 %.3f %.3f; slips %zu and %zu; noise %.2f and %.2f mm LOS\n",
        s.name().c_str(), s.error_los_m.ks.value(), s.error_nlos_m.ks.value(), s.cn0_los_dbhz.ks.value(),
        s.cn0_nlos_dbhz.ks.value(), phase.slips, s.phase.simulated.slips, 1e3 * *phase.los.noise_m,
        1e3 * *s.phase.simulated.los.noise_m);
    EXPECT_EQ(phase.slips, signal_entry.slips) << s.name();
    EXPECT_EQ(phase.los.with_phase + phase.nlos.with_phase, signal_entry.with_phase) << s.name();
    EXPECT_EQ(phase.los.observations + phase.nlos.observations, signal_entry.observations) << s.name();
    EXPECT_EQ(phase.time_s, static_cast<double>(signal_entry.with_phase)) << "at 1 Hz";
    EXPECT_GT(phase.slips, 20U) << s.name();
    EXPECT_NEAR(static_cast<double>(s.phase.simulated.slips), static_cast<double>(phase.slips),
                5 * std::sqrt(static_cast<double>(phase.slips)));
    EXPECT_LT(s.error_los_m.ks.value(), 0.1) << s.name();
    EXPECT_LT(s.cn0_los_dbhz.ks.value(), 0.1) << s.name();
    EXPECT_NEAR(s.tracked_nlos.ratio(Side::Simulated).value(), s.tracked_nlos.ratio(Side::Measured).value(),
                0.05)
        << s.name();
  }

  // Texts: a block for each further signal and a line of phases for every one.
  const std::string text = to_text(f);
  for (const char* name : {"GPS L2C", "GPS L5", "Galileo E5a", "Galileo E5b"}) {
    EXPECT_THAT(text, HasSubstr(std::string("\n") + name)) << name;
  }
  EXPECT_THAT(text, HasSubstr("\nCarrier phase"));
  EXPECT_THAT(text, Not(HasSubstr("not compared")));
}

// A system without its signal near L1 is left out, with a warning: simulated receivers track that signal.
TEST(FurtherSignals, ASystemWithoutItsFirstSignalIsLeftOut) {
  const SimulatedRecording recorded({}, [](simulation::ReceiverConfig& receiver) {
    three_bands(receiver);
    receiver.options.tracks = {"L1CA", "E5a", "E5b"};
  });
  const Recording recording = recorded.read();
  EXPECT_THAT(
      recording.warnings,
      testing::Contains("Galileo is recorded by E5a, E5b without E1, which the comparison needs: it is left "
                        "out"));
  const Comparison compared = compare_by(recorded, recording, 2, {"L1CA", "E1"});
  ASSERT_GT(compared.satellites.size(), 1000U);
  for (const ComparedSatellite& s : compared.satellites) ASSERT_EQ(s.id.system, gnss::System::GPS);
  EXPECT_THAT(to_text(all_metrics(compared)), Not(HasSubstr("Signals not compared")));
}

// Signals of only one side are listed, and the rest does not change.
TEST(FurtherSignals, OfOneSideAloneAreSaid) {
  const SimulatedRecording recorded({}, three_bands);
  const Recording recording = recorded.read();
  const Comparison all = compare_by(recorded, recording, 2);
  const Comparison fewer = compare_by(recorded, recording, 2, {"L1CA", "L1C", "L2C", "E1", "E5b"});
  const ModelMetrics f = all_metrics(fewer), f_all = all_metrics(all);
  const std::string text = to_text(f);
  EXPECT_THAT(text, HasSubstr("\nSignals not compared\n"
                              "  Signal       Recorded  Tracked by the simulated\n"
                              "  GPS L1C            no                       yes\n"
                              "  GPS L5            yes                        no\n"
                              "  Galileo E5a       yes                        no\n"));
  EXPECT_EQ(f.error_los_m.ks, f_all.error_los_m.ks);
  const auto l2c = [](const ModelMetrics& metrics) {
    return *std::find_if(metrics.signals.begin(), metrics.signals.end(),
                         [](const SignalMetrics& s) { return s.name() == "GPS L2C"; });
  };
  EXPECT_EQ(l2c(f).error_nlos_m.ks, l2c(f_all).error_nlos_m.ks);
  EXPECT_EQ(l2c(f).phase.simulated.slips, l2c(f_all).phase.simulated.slips);

  // A system that is not tracked at all: the others are compared without it.
  const Comparison gps = compare_by(recorded, recording, 2, {"L1CA"});
  for (const ComparedSatellite& s : gps.satellites) ASSERT_EQ(s.id.system, gnss::System::GPS);
  ASSERT_GT(gps.satellites.size(), 1000U);
  std::size_t satellite = 0;
  for (const ComparedSatellite& s : all.satellites) {
    if (s.id.system != gnss::System::GPS) continue;
    ASSERT_EQ(gps.satellites[satellite].id, s.id);
    // Simulated errors are relative to the clock from all clear satellites: here from fewer.
    ASSERT_EQ(gps.satellites[satellite].simulated.error_m.has_value(), s.simulated.error_m.has_value());
    if (s.simulated.error_m) {
      ASSERT_NEAR(*gps.satellites[satellite].simulated.error_m, *s.simulated.error_m, 5);
    }
    ASSERT_EQ(gps.satellites[satellite++].measured.error_m, s.measured.error_m);
  }
}

// A receiver's delay of one band is not part of its errors.
TEST(FurtherSignals, ConstantOfASignalIsTakenOff) {
  const SimulatedRecording recorded({}, three_bands);
  rinex::ObservationOptions wanted;
  wanted.all_signals = true;
  rinex::RinexObservations file = rinex::read_rinex_observations(recorded.obs, wanted);
  RecordingOptions options;
  options.ionosphere = options.troposphere = false;
  const auto judged = [&] {
    return compare_by(recorded,
                      join_recording(recorded.scenario(), recorded.environment(), recorded.obs, file,
                                     recorded.truth_csv, "csv", options),
                      2);
  };
  const Comparison plain = judged();
  for (rinex::ObservationEpoch& epoch : file.epochs) {
    for (rinex::ObservedSignal& s : epoch.signals) {
      if (s.signal->name == "L2C") *s.pseudorange_m += 7.5;
    }
  }
  const Comparison biased = judged();
  std::size_t compared = 0;
  for (std::size_t i = 0; i < plain.satellites.size(); ++i) {
    EXPECT_EQ(plain.satellites[i].measured.error_m, biased.satellites[i].measured.error_m);
    ASSERT_EQ(plain.satellites[i].more.size(), biased.satellites[i].more.size());
    for (std::size_t k = 0; k < plain.satellites[i].more.size(); ++k) {
      const auto &a = plain.satellites[i].more[k].measured.error_m,
                 &b = biased.satellites[i].more[k].measured.error_m;
      ASSERT_EQ(a.has_value(), b.has_value());
      if (!a) continue;
      ++compared;
      // A satellite moves 30 micrometres while its signal is late by 7.5 m.
      EXPECT_NEAR(*a, *b, 1e-4);
    }
  }
  EXPECT_GT(compared, 2000U);
}

// Recorded ephemerides (with TGD), an ionosphere of metres and no noise: residuals of L2C and L5 are the
// clock.
TEST(FurtherSignals, ResidualsKnowGroupDelaysAndTheIonosphereOfTheirCarriers) {
  CANYON_SHARED_DATA(nav, "urbannav-tst-20190428/hksc1180.19n");
  const test::TemporaryFolder folder;
  const auto simulation = test::prepare(R"(
city: {open: true, origin: {latitude_deg: 22.298, longitude_deg: 114.178, height_m: 10}}
sky: {navigation: [hksc1180.19n], systems: [GPS], errors: {enabled: false}}
start: 2019-04-28T12:58:03Z
duration_s: 60
trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}
receivers: [{name: rover, profile: ideal, elevation_mask_deg: 10, ionosphere: true, troposphere: true,
             tracks: [L1CA, L2C, L5], clock: {bias_s: 2.0e-4, drift: 1.0e-7}}]
)",
                                        nav.parent_path());
  test::Recorder recorder;
  const auto file = encoding::open_file("rinex_observation", folder / "rover.obs", 0,
                                        encoding::describe_receiver(simulation, 0));
  simulation.run({&recorder, file.get()});
  rinex::ObservationOptions wanted;
  wanted.all_signals = true;
  const auto recorded = rinex::read_rinex_observations(folder / "rover.obs", wanted);
  std::vector<std::pair<geodesy::GpsTime, geodesy::Geodetic>> truth;
  for (const simulation::Epoch& e : recorder.epochs) {
    truth.emplace_back(e.observed.time, geodesy::geodetic_from_ecef(e.truth_ecef));
  }
  const simulation::Environment& environment = simulation.environment();
  const auto residuals = pseudorange_residuals(recorded.epochs, simulation::Trajectory(truth),
                                               environment.sky(), environment.klobuchar());
  const auto clocks =
      remove_receiver_clock(residuals, [](const PseudorangeResidual&, const ResidualEpoch&) { return true; });
  double worst_m = 0;
  std::map<std::string_view, std::size_t> count;
  for (std::size_t e = 0; e < residuals.epochs.size(); ++e) {
    const ResidualEpoch& epoch = residuals.epochs[e];
    for (std::size_t i = epoch.first_further; i < epoch.first_further + epoch.further; ++i) {
      const PseudorangeResidual& o = residuals.further[i];
      worst_m = std::max(worst_m, std::abs(o.residual_m - clocks.clocks[e].bias_m));
      ++count[o.signal->name];
    }
  }
  std::printf("%zu of L2C, %zu of L5: within %.2g m of the clock\n", count["L2C"], count["L5"], worst_m);
  EXPECT_GT(count["L2C"], 100U);
  EXPECT_GT(count["L5"], 100U);
  // RINEX has millimetres.
  EXPECT_LT(worst_m, 1.5e-3);
}

}  // namespace
}  // namespace canyon::validation
