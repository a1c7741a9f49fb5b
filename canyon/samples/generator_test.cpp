// Samples against what Canyon's own receiver measures of the same arrivals.
#include "canyon/samples/generator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <optional>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/samples/waveform.hpp"
#include "canyon/simulation/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/tracking/channel.hpp"

namespace canyon::samples {
namespace {

using geodesy::kSpeedOfLight;
using propagation::PathKind;
constexpr double kTurn = 2 * geodesy::kPi;

/// Leaves one satellite, with its direct path or with the one over a wall 30 m west of the origin.
class OneWay final : public disturbance::Disturbance {
 public:
  OneWay(gnss::SatelliteId id, bool wall) : id_(id), wall_(wall) {}
  void apply(const propagation::Antenna& /*antenna*/, propagation::Arrival& arrival) override {
    std::vector<propagation::SatelliteView> views;
    for (propagation::SatelliteView& view : arrival.views) {
      if (view.line.id != id_) continue;
      if (wall_) {
        const Eigen::Vector3d s = arrival.ecef_from_enu.transpose() * view.line.direction_ecef;
        const double height_m = arrival.antenna_enu.x() + 30;
        propagation::Path path;
        path.kind = PathKind::Reflected;
        path.order = 1;
        path.arrival = {-s.x(), s.y(), s.z()};
        path.point = arrival.antenna_enu + path.arrival * (height_m / s.x());
        path.excess_m = 2 * height_m * s.x();
        path.incidence_count = 1;
        path.incidences[0].material = city::Material::Metal;
        path.incidences[0].incidence_rad = std::acos(s.x());
        path.arrival_elevation_rad = std::asin(s.z());
        path.reflector = 77;
        view.paths.paths = {path};
      }
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
    generator.next(epoch, [this](const Block& block, std::size_t samples) {
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
      "sky: {nominal: true, systems: [GPS]}\n"
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
simulation::Simulation simulate(const Setting& setting) {
  const simulation::Scenario made = scenario(setting);
  city::City city;
  city.frame = geodesy::LocalFrame(made.city.import.origin);
  return {made, std::move(city)};
}
constexpr gnss::SatelliteId kHigh{gnss::System::GPS, 15}, kEast{gnss::System::GPS, 9};

/// What a correlator finds about a measurement: amplitude with the measurement's phase taken off, and how far
/// off the code is [m], by the samples that have the sign of another chip.
struct Found {
  std::complex<double> prompt;
  double delay_m = 0;
};
Found correlate(const Recorder& recorded, const FrontEnd& front_end, const simulation::Simulation& simulation,
                const simulation::Epoch& epoch) {
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
    return front_end.real ? std::complex<double>(std::sqrt(2.0) * value.real()) : std::complex<double>(value);
  };
  Found found;
  double others = 0;
  for (std::int64_t n = middle - kHalf; n < middle + kHalf; ++n) {
    const double t = first_s + static_cast<double>(n) / front_end.rate_hz - reading_s;
    const double cycles = *m.carrier_phase_cycles - *m.doppler_hz * t -
                          std::remainder(front_end.intermediate_hz * (t + reading_s), 1);
    const auto slot = static_cast<std::int64_t>(std::floor(slot_at(n))) - base;
    const std::complex<double> product = value_of(recorded.values.at(static_cast<std::size_t>(n))) *
                                         static_cast<double>(slots.re[static_cast<std::size_t>(slot)]) *
                                         std::polar(1.0, kTurn * std::remainder(cycles, 1));
    found.prompt += product / (2.0 * kHalf);
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
    const Found found = correlate(recorded, front_end, simulation, epoch);
    EXPECT_NEAR(std::arg(found.prompt) / kTurn, 0, 2e-3) << into_s;
    EXPECT_LT(found.delay_m, 0.1) << into_s;
    const double cn0_dbhz = *satellites[0].cn0_dbhz;
    EXPECT_NEAR(20 * std::log10(std::abs(found.prompt)), cn0_dbhz + 10 * std::log10(2 / front_end.rate_hz),
                0.02);
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

/// Takes every satellite away, and adds a wave.
class Jammer final : public disturbance::Disturbance {
 public:
  explicit Jammer(const propagation::Spectrum& spectrum) { wave_.spectrum = spectrum; }
  void apply(const propagation::Antenna& /*antenna*/, propagation::Arrival& arrival) override {
    arrival.views.clear();
    wave_.power_dbw = -120;
    arrival.interference.push_back(wave_);
  }

 private:
  propagation::Interference wave_;
};

TEST(Generator, JammersHaveTheirPowerWithinTheBand) {
  using Shape = propagation::Spectrum::Shape;
  struct Case {
    Shape shape;
    double offset_hz, width_hz, share;
  };
  for (const Case& each :
       {Case{Shape::Tone, 4e5, 0, 1}, Case{Shape::Tone, 3e6, 0, 0}, Case{Shape::Chirp, 0, 2e6, 1},
        Case{Shape::Chirp, 0, 8e6, 0.5}, Case{Shape::Band, 5e5, 1e6, 1}, Case{Shape::Band, 2e6, 2e6, 0.5}}) {
    propagation::Spectrum spectrum;
    spectrum.shape = each.shape;
    spectrum.centre_hz = gnss::kL1_hz + each.offset_hz;
    spectrum.width_hz = each.width_hz;
    spectrum.period_s = 1e-5;
    simulation::Scenario made = scenario({2, kHigh, false, false, {}});
    made.duration_s = 0.5;
    made.receivers[0].disturbances.push_back({"jammer", [spectrum](std::uint64_t, const std::string&) {
                                                return std::make_unique<Jammer>(spectrum);
                                              }});
    city::City city;
    city.frame = geodesy::LocalFrame(made.city.import.origin);
    const simulation::Simulation simulation(made, std::move(city));
    FrontEnd front_end;
    front_end.noise = false;
    Recorder recorded(simulation, front_end);
    (void)simulation.run({&recorded});
    double power = 0;
    for (const std::complex<float> value : recorded.values) power += std::norm(value);
    power /= static_cast<double>(recorded.values.size());
    propagation::Interference wave;
    wave.spectrum = spectrum;
    wave.power_dbw = -120;
    const tracking::ChannelModel model(made.receivers[0].options.signal, 1, "rx");
    std::vector<tracking::ReceivedWave> received;
    model.receive(std::array{wave}, received);
    const double over_noise_hz = received.at(0).over_noise_hz[static_cast<std::size_t>(signal::Band::Upper)];
    EXPECT_NEAR(power / (over_noise_hz * 2 / front_end.rate_hz), each.share, 0.04)
        << static_cast<int>(each.shape) << ' ' << each.offset_hz << ' ' << each.width_hz;
  }
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
