// Samples compared with the measurements of Canyon's own receiver of the same arrivals.
#include "canyon/simulation/samples/generator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <optional>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/receiver/tracking/channel.hpp"
#include "canyon/simulation/samples/mixer.hpp"
#include "canyon/simulation/samples/path_interpolator.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/wall_reflection.hpp"

namespace canyon::samples {
namespace {

using geodesy::kSpeedOfLight;
using propagation::PathKind;
constexpr double kTwoPi = 2 * geodesy::kPi;

/// Keeps one satellite, with its direct path or with the one over a wall 30 m west of the origin.
class OneWay final : public disturbance::Disturbance {
 public:
  OneWay(gnss::SatelliteId id, bool wall) : id_(id), wall_(wall) {}
  void apply(const propagation::Antenna& /*antenna*/, propagation::Arrival& arrival) override {
    std::vector<propagation::SatelliteView> views;
    for (propagation::SatelliteView& view : arrival.views) {
      if (view.line.id != id_) continue;
      if (wall_) view.paths.paths = {test::wall_reflection(arrival, view, 30)};
      views.push_back(view);
    }
    arrival.views = std::move(views);
  }

 private:
  gnss::SatelliteId id_;
  bool wall_;
};

class Recorder final : public simulation::EpochSink {
 public:
  Recorder(const simulation::Simulation& simulation, FrontEnd front_end, int threads = 0)
      : generator(simulation.scenario().receivers[0].options, simulation.scenario().seed,
                  simulation.environment().klobuchar(), front_end, threads) {}
  void write(const simulation::Epoch& epoch) override {
    epochs.push_back(epoch);
    generator.next(epoch, [this](const SampleBlock& block, std::size_t samples) {
      for (std::size_t n = 0; n < samples; ++n) values.emplace_back(block.re[n], block.im[n]);
    });
  }
  void finish() override {}
  Generator generator;
  std::vector<simulation::Epoch> epochs;
  std::vector<std::complex<float>> values;
};

struct Setting {
  double rate_hz = 2;
  gnss::SatelliteId satellite;
  bool wall = false, alone = true;
  std::string receiver;
};
simulation::Scenario scenario(const Setting& setting) {
  simulation::Scenario made = simulation::parse_scenario(
      "city: {open: true, origin: {latitude_deg: 48, longitude_deg: 11, height_m: 500}}\n"
      "sky: {nominal: true, systems: [GPS], errors: {enabled: false}}\n"
      "start: 2026-06-01T08:00:00Z\n"
      "rate_hz: " +
          std::to_string(setting.rate_hz) +
          "\nduration_s: 2\n"
          "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 90, north_m: 40, up_m: 2}], "
          "speed_mps: 20}\n"
          "receivers: [{name: rx, noise: {enabled: false}, ionosphere: true, troposphere: true,\n"
          "  clock: {bias_s: 3e-5, drift: 2e-7, drift_walk: 0}, signal: {enabled: true, loop_noise: false, "
          "cn0_step_db: 0, cn0_sigma_db: 0}" +
          setting.receiver + "}]\n",
      "test.yaml");
  const auto [id, wall] = std::pair(setting.satellite, setting.wall);
  if (setting.alone) {
    made.receivers[0].disturbances.push_back(
        {"one way", [id = id, wall = wall](std::uint64_t, const std::string&) {
           return std::make_unique<OneWay>(id, wall);
         }});
  }
  return made;
}
simulation::Simulation simulate(const simulation::Scenario& made) {
  city::City city;
  city.frame = geodesy::LocalFrame(*made.city.origin);
  return {made, std::move(city)};
}
simulation::Simulation simulate(const Setting& setting) {
  return simulate(scenario(setting));
}
constexpr gnss::SatelliteId kHigh{gnss::System::GPS, 15}, kEast{gnss::System::GPS, 9};

/// The result of a correlator near a measurement: amplitude with the measurement's phase removed, and the
/// code error [m], by the samples that have the sign of another chip. Early and late are half a chip away.
struct FoundTone {
  std::complex<double> prompt, early, late;
  double delay_m = 0;
};
FoundTone correlate(const Recorder& recorded, const FrontEnd& front_end,
                    const simulation::Simulation& simulation, const simulation::Epoch& epoch) {
  const receiver::SatelliteObservation& satellite = epoch.observed.satellites.at(0);
  const positioning::Measurement& m = *satellite.measurement;
  const geodesy::GpsTime zero = recorded.epochs.front().truth.time;  // a whole second
  Waveform waveform(satellite.id, *satellite.signal, zero);
  EXPECT_TRUE(waveform.read_symbols(simulation.navigation(), 0, 4));
  const double first_s = recorded.epochs.front().observed.clock_bias_s;
  const double reading_s = epoch.truth.time - zero + epoch.observed.clock_bias_s;
  const double wavelength = kSpeedOfLight / m.carrier_frequency_hz;
  const auto middle = static_cast<std::int64_t>((reading_s - first_s) * front_end.rate_hz);
  constexpr std::int64_t kHalf = 40'000;  // 10 ms
  const auto slot_at = [&](std::int64_t n) {
    const double t = first_s + static_cast<double>(n) / front_end.rate_hz;
    const double range_m = m.pseudorange_m - wavelength * *m.doppler_hz * (t - reading_s);
    return (t - range_m / kSpeedOfLight) * waveform.slot_rate_hz();
  };
  Slots slots;
  const auto base = static_cast<std::int64_t>(std::floor(slot_at(middle - kHalf))) - 10;
  waveform.send(base, static_cast<std::size_t>(slot_at(middle + kHalf)) - static_cast<std::size_t>(base) + 20,
                slots);
  // A real signal has half of its power at negative frequencies, which a correlator averages out.
  const auto value_of = [&](std::complex<float> value) {
    const double scale = front_end.bandwidth_hz > 0 ? 2 : std::sqrt(2.0);
    return front_end.real ? std::complex<double>(scale * value.real()) : std::complex<double>(value);
  };
  FoundTone found;
  double others = 0;
  for (std::int64_t n = middle - kHalf; n < middle + kHalf; ++n) {
    const double t = first_s + static_cast<double>(n) / front_end.rate_hz - reading_s;
    const double cycles = *m.carrier_phase_cycles - *m.doppler_hz * t -
                          std::remainder(front_end.intermediate_hz * (t + reading_s), 1);
    const std::complex<double> carrier = value_of(recorded.values.at(static_cast<std::size_t>(n))) *
                                         std::polar(1 / (2.0 * kHalf), kTwoPi * std::remainder(cycles, 1));
    const auto times_code = [&](double chips_ahead) {
      const auto slot = static_cast<std::int64_t>(std::floor(slot_at(n) + chips_ahead)) - base;
      return carrier * static_cast<double>(slots.re[static_cast<std::size_t>(slot)]);
    };
    const std::complex<double> product = times_code(0);
    found.prompt += product;
    found.early += times_code(0.5);
    found.late += times_code(-0.5);
    if (!front_end.real && product.real() < 0) others += 1 / (2.0 * kHalf);
  }
  // Every other chip ends with a change of sign.
  found.delay_m = 2 * others * kSpeedOfLight / waveform.slot_rate_hz();
  return found;
}

/// The samples' code, phase and strength at each epoch but the first and last two are the receiver's.
void expect_as_measured(const Setting& setting, double truth_rate_hz, FrontEnd front_end = {}) {
  front_end.noise = false;
  const simulation::Simulation simulation = simulate(setting);
  Recorder recorded(simulation, front_end);
  (void)simulation.run({&recorded});
  Setting dense = setting;
  dense.rate_hz = truth_rate_hz;
  const simulation::Simulation reference = simulate(dense);
  Recorder truth(reference, front_end);
  (void)reference.run({&truth});
  int compared = 0;
  for (const simulation::Epoch& epoch : truth.epochs) {
    const double into_s = epoch.truth.time - truth.epochs.front().truth.time;
    const auto& satellites = epoch.observed.satellites;
    if (into_s < 0.1 || into_s > 1.9 || satellites.empty() || !satellites[0].measurement ||
        !satellites[0].measurement->carrier_phase_cycles) {
      continue;
    }
    ++compared;
    const FoundTone found = correlate(recorded, front_end, simulation, epoch);
    EXPECT_NEAR(std::arg(found.prompt) / kTwoPi, 0, 2e-3) << into_s;
    const double cn0_dbhz = *satellites[0].cn0_dbhz;
    if (front_end.bandwidth_hz > 0) {
      // The density of the noise is 2 over the filter's noise bandwidth; a fraction of the code's power is
      // left.
      const double rate_hz = kOversampling * front_end.rate_hz, half_hz = front_end.bandwidth_hz / 2;
      const std::vector<float> taps =
          low_pass(rate_hz, half_hz, std::min(2 * kStop * half_hz, front_end.room_hz()));
      const tracking::Correlation code;
      double fraction = 0;
      for (std::size_t k = 0; k < taps.size(); ++k) {
        const std::size_t middle = taps.size() / 2;
        const double delay = static_cast<double>(k) - static_cast<double>(middle);
        fraction += taps[k] * code.value(delay / rate_hz * code.options().chip_rate_hz);
      }
      EXPECT_NEAR(20 * std::log10(std::abs(found.prompt)),
                  cn0_dbhz + 10 * std::log10(2 / rate_hz * fraction * fraction), 0.06);
      // A metre makes 0.007; a sample before the decimation would be 19 m.
      EXPECT_NEAR(std::abs(found.early) / std::abs(found.late), 1, 0.015) << into_s;
    } else {
      EXPECT_LT(found.delay_m, 0.1) << into_s;
      EXPECT_NEAR(20 * std::log10(std::abs(found.prompt)), cn0_dbhz + 10 * std::log10(2 / front_end.rate_hz),
                  0.02);
    }
  }
  EXPECT_GE(compared, 3);
}

TEST(Generator, DirectSignalsAreWhatReceiversMeasure) {
  expect_as_measured({2, kHigh, false, true, {}}, 2);
}
TEST(Generator, BetweenEpochsAsWell) {
  expect_as_measured({1, kHigh, false, true, {}}, 4);
}
TEST(Generator, ReflectionsAreWhatReceiversMeasure) {
  expect_as_measured({2, kEast, true, true, {}}, 8);
}

TEST(Generator, SignalsComeOutAtTheIntermediateFrequency) {
  FrontEnd front_end;
  front_end.intermediate_hz = 0.7e6;
  expect_as_measured({2, kHigh, false, true, {}}, 2, front_end);
  front_end.real = true;
  front_end.rate_hz = 16.0367e6;
  front_end.intermediate_hz = 4.092e6;
  expect_as_measured({2, kHigh, false, true, {}}, 2, front_end);
}

TEST(Generator, AFilterDelaysNothing) {
  FrontEnd front_end;
  front_end.bandwidth_hz = 2.5e6;
  expect_as_measured({2, kHigh, false, true, {}}, 2, front_end);
  front_end.intermediate_hz = 0.4e6;
  expect_as_measured({2, kHigh, false, true, {}}, 2, front_end);
  front_end.real = true;
  front_end.rate_hz = 8.0183e6;
  front_end.intermediate_hz = 2.046e6;
  expect_as_measured({2, kHigh, false, true, {}}, 2, front_end);
}

TEST(Generator, RealSamplesHaveNoiseOfDeviationOneAndNoneOfItsImage) {
  const Setting setting{2, kHigh, false, false, {}};
  const simulation::Simulation simulation = simulate(setting);
  FrontEnd front_end;
  front_end.real = true;
  front_end.intermediate_hz = 1e6;
  Recorder noisy(simulation, front_end);
  (void)simulation.run({&noisy});
  front_end.noise = false;
  Recorder quiet(simulation, front_end);
  (void)simulation.run({&quiet});
  double power = 0;
  for (std::size_t i = 0; i < noisy.values.size(); ++i) {
    power += std::pow(noisy.values[i].real() - quiet.values[i].real(), 2);
  }
  EXPECT_NEAR(power / static_cast<double>(noisy.values.size()), 1, 2e-3);
}

TEST(Generator, NoiseIsOfDeviationOneAndTheBytesDoNotDependOnThreads) {
  const Setting setting{2, kHigh, false, false, {}};
  const simulation::Simulation simulation = simulate(setting);
  Recorder one(simulation, {}, 1), two(simulation, {}, 2);
  (void)simulation.run({&one, &two});
  ASSERT_EQ(one.values.size(), 8'000'002U);
  EXPECT_TRUE(one.values == two.values);
  FrontEnd quiet;
  quiet.noise = false;
  Recorder signals(simulation, quiet);
  (void)simulation.run({&signals});
  std::complex<double> next;
  double re = 0, im = 0, fourth = 0;
  const auto n = static_cast<double>(one.values.size());
  std::complex<double> last;
  for (std::size_t i = 0; i < one.values.size(); ++i) {
    const std::complex<double> noise(one.values[i] - signals.values[i]);
    re += noise.real() * noise.real() / n;
    im += noise.imag() * noise.imag() / n;
    fourth += std::pow(noise.real(), 4) / n;
    next += noise * std::conj(last) / n;
    last = noise;
  }
  EXPECT_NEAR(re, 1, 2e-3);
  EXPECT_NEAR(im, 1, 2e-3);
  EXPECT_NEAR(fourth / (re * re), 3, 0.015);
  EXPECT_NEAR(std::abs(next), 0, 3e-3);  // white
}

struct Wave {
  propagation::Spectrum spectrum;
  double power_dbw = -120;
  bool alone = true;  ///< no satellites
};
/// Adds a wave to the arrivals.
class Jammer final : public disturbance::Disturbance {
 public:
  explicit Jammer(Wave wave) : wave_(std::move(wave)) {}
  void apply(const propagation::Antenna& /*antenna*/, propagation::Arrival& arrival) override {
    if (wave_.alone) arrival.views.clear();
    propagation::Interference& added = arrival.interference.emplace_back();
    added.spectrum = wave_.spectrum;
    added.power_dbw = wave_.power_dbw;
  }

 private:
  Wave wave_;
};

/// Samples of a run of `made`, with the jammer.
std::vector<std::complex<float>> jammed(simulation::Scenario made, const Wave& wave,
                                        const FrontEnd& front_end, int threads = 0) {
  made.receivers[0].disturbances.push_back(
      {"jammer", [wave](std::uint64_t, const std::string&) { return std::make_unique<Jammer>(wave); }});
  const simulation::Simulation simulation = simulate(made);
  Recorder recorded(simulation, front_end, threads);
  (void)simulation.run({&recorded});
  return recorded.values;
}

/// Mean power of the samples from `first` on, only of their real parts if `real`.
double power_of(const std::vector<std::complex<float>>& values, std::size_t first = 0, bool real = false) {
  double sum = 0;
  for (std::size_t n = first; n < values.size(); ++n) {
    sum += real ? std::pow(values[n].real(), 2) : std::norm(values[n]);
  }
  return sum / static_cast<double>(values.size() - first);
}

TEST(Generator, WhatIsStrongBesideTheBandTakesGainFromTheSignals) {
  propagation::Spectrum tone;
  tone.shape = propagation::Spectrum::Shape::Tone;
  tone.centre_hz = gnss::kL1_hz + 10e6;
  const auto amplitude = [&](double power_dbm) {
    simulation::Scenario made = scenario({2, kHigh, false, true, {}});
    made.receivers[0].options.signal.antenna = signal::isotropic_antenna();
    made.receivers[0].options.signal.front_end_compression_dbm =
        -40 - 10 * std::log10(2.0);  // of a linear wave half
    FrontEnd front_end;
    front_end.noise = false;
    return std::sqrt(power_of(jammed(made, {tone, power_dbm - 30, false}, front_end)));
  };
  const double alone = amplitude(-150);
  EXPECT_GT(alone, 0.01);
  EXPECT_NEAR(amplitude(-40) / alone, 1 - 0.2175, 1e-3);
  EXPECT_NEAR(amplitude(-43) / alone, 1 - 0.2175 * std::pow(10, -0.3), 1e-3);
}

TEST(Generator, JammersHaveTheirPowerWithinTheBand) {
  using Shape = propagation::Spectrum::Shape;
  struct Case {
    Shape shape;
    double offset_hz, width_hz, fraction;
  };
  for (const Case& each :
       {Case{Shape::Tone, 4e5, 0, 1}, Case{Shape::Tone, 3e6, 0, 0}, Case{Shape::Chirp, 0, 2e6, 1},
        Case{Shape::Chirp, 0, 8e6, 0.5}, Case{Shape::Band, 5e5, 1e6, 1}, Case{Shape::Band, 2e6, 2e6, 0.5},
        Case{Shape::Band, 0, 8e6, 0.5}}) {
    propagation::Spectrum spectrum;
    spectrum.shape = each.shape;
    spectrum.centre_hz = gnss::kL1_hz + each.offset_hz;
    spectrum.width_hz = each.width_hz;
    spectrum.period_s = 1e-5;
    simulation::Scenario made = scenario({2, kHigh, false, false, {}});
    made.duration_s = 0.5;
    FrontEnd front_end;
    front_end.noise = false;
    const std::vector<std::complex<float>> values = jammed(made, {spectrum}, front_end);
    const double power = power_of(values);
    propagation::Interference wave;
    wave.spectrum = spectrum;
    wave.power_dbw = -120;
    const tracking::ChannelModel model(made.receivers[0].options.signal, 1, "rx");
    std::vector<tracking::ReceivedWave> received;
    model.receive(std::array{wave}, received);
    const double over_noise_hz = received.at(0).over_noise_hz[static_cast<std::size_t>(signal::Band::Upper)];
    EXPECT_NEAR(power / (over_noise_hz * 2 / front_end.rate_hz), each.fraction, 0.04)
        << static_cast<int>(each.shape) << ' ' << each.offset_hz << ' ' << each.width_hz;
    if (each.shape == Shape::Tone || each.fraction < 1) continue;
    // A flat spectrum has the autocorrelation sin(x) / x, x = pi width times the lag; sweeps are
    // uncorrelated.
    const bool flat = each.shape == Shape::Band;
    const std::size_t lag = flat ? 2 : 40;
    std::complex<double> later;
    for (std::size_t n = lag; n < values.size(); ++n) {
      later += std::complex<double>(values[n]) * std::conj(std::complex<double>(values[n - lag]));
    }
    const double x = kTwoPi / 2 * each.width_hz * 2 / front_end.rate_hz;
    EXPECT_NEAR(std::abs(later) / (power * static_cast<double>(values.size())), flat ? std::sin(x) / x : 0,
                0.02);
  }
}

/// Samples of only a tone at this distance from the band's centre.
std::vector<std::complex<float>> tone(double offset_hz, const FrontEnd& front_end, int threads = 0) {
  propagation::Spectrum spectrum;
  spectrum.shape = propagation::Spectrum::Shape::Tone;
  spectrum.centre_hz = front_end.centre_hz + offset_hz;
  simulation::Scenario made = scenario({2, kHigh, false, false, {}});
  made.duration_s = 0.5;
  return jammed(made, {spectrum}, front_end, threads);
}

TEST(Generator, WhatIsBeyondTheFiltersBandDoesNotFoldBack) {
  for (const bool real : {false, true}) {
    FrontEnd front_end;
    front_end.noise = false;
    front_end.real = real;
    front_end.rate_hz = real ? 8e6 : 4e6;
    front_end.intermediate_hz = real ? 2e6 : 0;
    front_end.bandwidth_hz = 2.5e6;
    constexpr std::size_t kFilled = 500;  // samples, of the filter
    const double within = power_of(tone(0.3e6, front_end), kFilled, real);
    EXPECT_GT(within, 1);
    for (const double hz : {-1.25e6, 1.25e6}) {
      EXPECT_NEAR(10 * std::log10(power_of(tone(hz, front_end), kFilled, real) / within), 0, 0.05) << hz;
    }
    // At the rate's multiples, where samples without a filter cannot distinguish it from the band's centre,
    // beyond the computed frequencies, and next to the band.
    for (const double hz : {-1.9e6, 1.9e6, 3.7e6, 4e6, -4e6, 7.5e6, 8e6, 12e6, 16.3e6}) {
      EXPECT_LT(power_of(tone(hz, front_end), kFilled, real), 1e-6 * within) << hz;
    }
    // One tone from block to block, on any threads.
    const std::vector<std::complex<float>> one = tone(0.3e6, front_end, 1), two = tone(0.3e6, front_end, 2);
    EXPECT_TRUE(one == two);
    if (real) continue;
    const std::complex<float> step(std::polar(1.0, kTwoPi * 0.3 / 4));
    for (std::size_t n = kFilled; n < one.size(); ++n) {
      ASSERT_LT(std::abs(one[n] - one[n - 1] * step), 1e-3 * std::abs(one[n])) << n;
    }
  }
}

TEST(Generator, FilteredNoiseHasDeviationOneAndItsBand) {
  FrontEnd front_end;
  front_end.bandwidth_hz = 2e6;
  const simulation::Simulation simulation = simulate({2, {gnss::System::GPS, 63}, false, true, {}});
  Recorder recorded(simulation, front_end);
  (void)simulation.run({&recorded});
  double re = 0, im = 0;
  for (const std::complex<float> value : recorded.values) {
    re += std::pow(value.real(), 2) / static_cast<double>(recorded.values.size());
    im += std::pow(value.imag(), 2) / static_cast<double>(recorded.values.size());
  }
  EXPECT_NEAR(re, 1, 3e-3);
  EXPECT_NEAR(im, 1, 3e-3);
  // Power at frequencies, of 4000 samples each, over that of white noise.
  const auto at = [&](double hz) {
    double sum = 0;
    constexpr std::size_t kLength = 4000;
    for (std::size_t n = 0; n + kLength <= recorded.values.size(); n += 4 * kLength) {
      std::complex<double> found;
      for (std::size_t k = 0; k < kLength; ++k) {
        found +=
            std::complex<double>(recorded.values[n + k]) *
            std::polar(1.0, -kTwoPi * std::remainder(hz / front_end.rate_hz * static_cast<double>(k), 1));
      }
      sum += std::norm(found) / (2.0 * kLength);
    }
    return sum / (static_cast<double>(recorded.values.size()) / (4 * kLength));
  };
  // The filter is half as high at 1.25 MHz: 4 MHz of white noise within 2.5 MHz or a little less.
  EXPECT_NEAR(at(0), 1.67, 0.25);
  EXPECT_NEAR(at(0.9e6), 1.67, 0.25);
  EXPECT_LT(at(1.7e6), 1e-3);
  EXPECT_LT(at(-1.9e6), 1e-3);
}

TEST(Generator, RefusesWhatItCannotSample) {
  const simulation::Simulation simulation = simulate({2, kHigh, false, true, {}});
  const receiver::ReceiverOptions& options = simulation.scenario().receivers[0].options;
  FrontEnd front_end;
  front_end.rate_hz = 5e5;
  EXPECT_THROW(Generator(options, 1, {}, front_end), InputError);
  // The centre is aliased.
  front_end = {};
  for (const double hz : {-2.1e6, 2.1e6}) {
    front_end.intermediate_hz = hz;
    EXPECT_THROW(front_end.validate(), InputError) << hz;
  }
  front_end.intermediate_hz = -1.9e6;
  EXPECT_NO_THROW(front_end.validate());
  front_end.real = true;
  for (const double hz : {-1.9e6, 0.0, 2.1e6}) {
    front_end.intermediate_hz = hz;
    EXPECT_THROW(front_end.validate(), InputError) << hz;
  }
  // A filter's edges need space.
  front_end = {};
  for (const auto& [hz, bandwidth_hz, fits] : {std::tuple{0.0, 3.6e6, true},
                                               {0.0, 3.7e6, false},
                                               {1e6, 1.8e6, true},
                                               {1e6, 2e6, false},
                                               {0.0, 5e4, false},
                                               {0.0, -1.0, false}}) {
    front_end.intermediate_hz = hz;
    front_end.bandwidth_hz = bandwidth_hz;
    for (const bool real : {false, true}) {
      front_end.real = real;
      front_end.rate_hz = real ? 8e6 : 4e6;
      front_end.intermediate_hz = real ? 2e6 - hz : hz;
      if (fits) {
        EXPECT_NO_THROW(front_end.validate()) << hz << ' ' << bandwidth_hz;
      } else {
        EXPECT_THROW(front_end.validate(), InputError) << hz << ' ' << bandwidth_hz;
      }
    }
  }
  receiver::ReceiverOptions without = options;
  without.signal.enabled = false;
  EXPECT_THROW(Generator(without, 1, {}, FrontEnd{}), InputError);
}

TEST(Generator, CarriesWhatLiesWithin) {
  const gnss::Signal& l1 = gnss::signals_of(gnss::System::GPS)[0];
  FrontEnd front_end;
  EXPECT_TRUE(carries(front_end, l1, l1.carrier_hz));
  front_end.centre_hz += 1.8e6;
  EXPECT_FALSE(carries(front_end, l1, l1.carrier_hz));
  // Real: as far to 0 and to half of the rate.
  front_end = {};
  front_end.real = true;
  for (const auto& [hz, carried] : {std::pair{0.3e6, false}, {0.9e6, true}, {1.1e6, true}, {1.7e6, false}}) {
    front_end.intermediate_hz = hz;
    EXPECT_EQ(carries(front_end, l1, l1.carrier_hz), carried) << hz;
  }
  // Galileo E1 at 4 Msps; E5a of 10.23 Mchip/s at 12.5.
  front_end = {};
  const std::span<const gnss::Signal> galileo = gnss::signals_of(gnss::System::Galileo);
  EXPECT_TRUE(carries(FrontEnd{}, galileo[0], galileo[0].carrier_hz));
  front_end.centre_hz = galileo[1].carrier_hz;
  EXPECT_FALSE(carries(front_end, galileo[1], galileo[1].carrier_hz));
  front_end.rate_hz = 12.5e6;
  EXPECT_TRUE(carries(front_end, galileo[1], galileo[1].carrier_hz));
}

}  // namespace
}  // namespace canyon::samples
