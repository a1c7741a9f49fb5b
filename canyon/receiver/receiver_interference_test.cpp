// Effects of interference on a receiver: effective C/N0, gain control, lock.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/paths/disturbance/faults/transmitter.hpp"
#include "canyon/receiver/receiver.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/signal_scene.hpp"

namespace canyon::receiver {
namespace {

using namespace canyon::test;
using geodesy::kPi;
using propagation::Interference;
using propagation::Spectrum;
using Shape = Spectrum::Shape;

/// [dBW/Hz] of the link budget's defaults: k (211 K + 290 K (10^0.2 - 1)).
const double kNoise = 10 * std::log10(1.380649e-23 * (211 + 290 * (std::pow(10, 0.2) - 1)));

/// Right-hand from the zenith, so that an antenna of 0 dBic receives all of it.
Interference wave(Shape shape, double centre_hz, double power_dbw, double width_hz = 0, double period_s = 0) {
  Interference result;
  result.spectrum.shape = shape;
  result.spectrum.centre_hz = centre_hz;
  result.spectrum.width_hz = width_hz;
  result.spectrum.period_s = period_s;
  result.power_dbw = power_dbw;
  result.polarisation = propagation::Polarisation::Right;
  return result;
}

ReceiverEpoch observe_amid(Receiver& receiver, const orbit::Sky& sky, double seconds,
                           std::vector<Interference> waves) {
  propagation::Arrival arrival;
  arrival.views = open_sky(sky, kTime + seconds, kAntenna);
  arrival.ecef_from_enu = kEcefFromEnu;
  arrival.interference = std::move(waves);
  return receiver.observe({{kTime + seconds, kAntenna, kAtRest}, arrival, sky, {}});
}

/// Simpson's rule.
double integral(double low, double high, const std::function<double(double)>& f) {
  constexpr int kSteps = 8000;
  double sum = f(low) + f(high);
  for (int i = 1; i < kSteps; ++i) sum += (i % 2 == 1 ? 4 : 2) * f(low + (high - low) * i / kSteps);
  return sum * (high - low) / kSteps / 3;
}
double sinc(double x) {
  return x == 0 ? 1 : std::sin(kPi * x) / (kPi * x);
}
double bpsk(double f_hz, double rate_hz) {
  return std::pow(sinc(f_hz / rate_hz), 2) / rate_hz;
}
/// Sine-phased BOC(n,1): sinc^2(f) tan^2(pi f / 2n) (K&H 4.3.1).
double boc(double f_hz, int n) {
  const double f = f_hz / 1.023e6;
  return std::pow(sinc(f) * std::tan(kPi * f / (2 * n)), 2) / 1.023e6;
}
double tmboc(double f_hz) {
  return (29 * boc(f_hz, 1) + 4 * boc(f_hz, 6)) / 33;
}

/// For a front end of +-edge_hz: K&H 6.1 with 1 / (Q Rc) by quadrature of this file's spectra.
double effective_dbhz(double clear_dbhz, double j_over_s_db, double edge_hz,
                      const std::function<double(double)>& signal,
                      const std::function<double(double)>& jammer) {
  const double passed = integral(-edge_hz, edge_hz, signal);
  const double separation = integral(-edge_hz, edge_hz, [&](double f) { return signal(f) * jammer(f); });
  return -10 *
         std::log10(std::pow(10, -clear_dbhz / 10) + std::pow(10, j_over_s_db / 10) * separation / passed);
}

struct Case {
  const char* signal;
  std::function<double(double)> spectrum;
  double edge_hz;
};

class EffectiveCn0 : public ::testing::Test {
 protected:
  EffectiveCn0() {
    options.signal.front_end_bandwidth_hz = 8e6;
    options.signal.link.implementation_loss_db = 0;  // S / N0 is then C / N0
    options.signal.front_end_compression_dbm = std::numeric_limits<double>::infinity();
  }
  ReceiverOptions options = plain();
};

// Loss against J/S from 0 to 80 dB, for noise, matched noise, chirp and tone.
TEST_F(EffectiveCn0, FollowsJammerToSignalRatio) {
  const std::vector<Case> cases{
      {"L1CA", [](double f) { return bpsk(f, 1.023e6); }, 4e6},
      {"L1C", tmboc, 4e6},
      {"L5", [](double f) { return bpsk(f, 10.23e6); }, 10.23e6},
  };
  // G04, of a block that sends all of these.
  const double high = geodesy::radians(40);
  const orbit::FrozenSky sky(kPosition, {0, 0, 0, 0}, {high, high, high, high});
  options.signal.antenna = signal::AntennaPattern("both", {{0, 0, 0}}, {{0, 0, 0}});
  for (const Case& c : cases) {
    options.tracks = {c.signal};
    Receiver quiet(options, 1);
    const ReceiverEpoch clear_epoch = observe_amid(quiet, sky, 0, {});
    ASSERT_EQ(gnss::to_string(clear_epoch.satellites.back().id), "G04") << c.signal;
    const double clear_dbhz = *clear_epoch.satellites.back().cn0_dbhz;
    const gnss::Signal& signal = *clear_epoch.satellites.back().signal;
    ASSERT_EQ(signal.name, c.signal);
    const double rate = signal.chip_rate_hz, centre = signal.carrier_hz;
    Interference matched = wave(Shape::Code, centre, 0);
    matched.spectrum.modulation = signal.modulation;
    matched.spectrum.chip_rate_hz = rate;
    struct Jammer {
      const char* name;
      Interference wave;
      std::function<double(double)> density;
    };
    const auto flat = [](double f, double width) { return std::abs(f) <= width / 2 ? 1 / width : 0; };
    // The chirp's spectrum is flat except at edges and lines (interference_test.cpp): within 0.5 dB.
    const std::vector<Jammer> jammers{
        {"wide noise", wave(Shape::Band, centre, 0, 40e6), [&](double f) { return flat(f, 40e6); }},
        {"chirp", wave(Shape::Chirp, centre, 0, 40e6, 10e-6), [&](double f) { return flat(f, 40e6); }},
        {"matched", matched, c.spectrum},
    };
    for (const Jammer& jammer : jammers) {
      for (double ratio_db = 0; ratio_db <= 80; ratio_db += 10) {
        Receiver receiver(options, 1);
        Interference jam = jammer.wave;
        jam.power_dbw = kNoise + clear_dbhz + ratio_db;  // S is C/N0 over N0
        const ReceiverEpoch epoch = observe_amid(receiver, sky, 0, {jam});
        const double expected = effective_dbhz(clear_dbhz, ratio_db, c.edge_hz, c.spectrum, jammer.density);
        const double allowed = std::string(jammer.name) == "chirp" ? 0.5 : 0.02;
        EXPECT_NEAR(*epoch.satellites.back().cn0_dbhz, expected, allowed)
            << c.signal << ", " << jammer.name << ", J/S " << ratio_db;
      }
    }
    // Tones: except on L1 C/A's lines the density matters; for C/A the mean over a kilohertz.
    double mean = 0;
    constexpr int kTones = 40;
    const double off_hz = 0.4e6, ratio_db = 60;
    for (int i = 0; i < kTones; ++i) {
      Receiver receiver(options, 1);
      const Interference jam = wave(Shape::Tone, centre + off_hz + i * 25.0, kNoise + clear_dbhz + ratio_db);
      const ReceiverEpoch epoch = observe_amid(receiver, sky, 0, {jam});
      mean +=
          (std::pow(10, -*epoch.satellites.back().cn0_dbhz / 10) - std::pow(10, -clear_dbhz / 10)) / kTones;
    }
    const double passed = integral(-c.edge_hz, c.edge_hz, c.spectrum);
    EXPECT_NEAR(10 * std::log10(mean), ratio_db + 10 * std::log10(c.spectrum(off_hz) / passed), 0.1)
        << c.signal;
  }
}

// The same tone next to a line and on it: 20 ms of 1 ms codes resolve lines of 1 kHz (13 dB, or nothing).
TEST_F(EffectiveCn0, DependsOnTheLinesOfShortCodes) {
  Receiver quiet(options, 1);
  const ReceiverEpoch still = observe_amid(quiet, one_satellite(), 0, {});
  const double clear_dbhz = *still.satellites.front().cn0_dbhz;
  // A satellite fixed in the sky has only the Doppler of the rotating Earth.
  const double received_hz = 1575.42e6 + still.satellites.front().measurement->doppler_hz.value();
  const auto loss_db = [&](double off_hz) {
    Receiver receiver(options, 1);
    const auto jam = wave(Shape::Tone, received_hz + off_hz, kNoise + clear_dbhz + 40);
    return clear_dbhz - *observe_amid(receiver, one_satellite(), 0, {jam}).satellites.front().cn0_dbhz;
  };
  const double density = bpsk(200e3, 1.023e6), cn0 = std::pow(10, clear_dbhz / 10);
  EXPECT_NEAR(loss_db(200e3), 10 * std::log10(1 + cn0 * 1e4 * 20 * density / 0.9743), 0.1);
  EXPECT_NEAR(loss_db(200e3 + 500), 0, 1e-3);
}

// Gain control keeps the level constant: 1 / sqrt(1 + J / N) in the band of the front end, for each band.
TEST(ReceiverInterference, GainControlAndBands) {
  ReceiverOptions options = plain();
  options.signal.antenna = signal::AntennaPattern("both", {{0, 0, 0}}, {{0, 0, 0}});
  options.signal.front_end_bandwidth_hz = 8e6;
  options.signal.front_end_compression_dbm = std::numeric_limits<double>::infinity();
  options.tracks = {"L1CA", "E1", "L2C", "G1"};
  Receiver receiver(options, 1);
  // 20 MHz of noise on L1, three times the receiver's own within its 8 MHz; plus a tone as strong as the
  // noise of 8 MHz.
  const double within_dbw = kNoise + 10 * std::log10(8e6);
  const ReceiverEpoch epoch =
      observe_amid(receiver, four_systems(), 0,
                   {wave(Shape::Band, 1575.42e6, within_dbw + 10 * std::log10(3 * 20.0 / 8), 20e6),
                    wave(Shape::Tone, 1576e6, within_dbw)});
  ASSERT_EQ(epoch.bands.size(), 3U);  // L2, L1, G1
  EXPECT_EQ(epoch.bands[0].carrier_hz, 1227.6e6);
  EXPECT_EQ(epoch.bands[0].interference_ratio, 0);
  EXPECT_EQ(epoch.bands[0].agc(), 1);
  EXPECT_EQ(epoch.bands[1].carrier_hz, 1575.42e6);
  EXPECT_NEAR(epoch.bands[1].interference_ratio, 4, 1e-9);
  EXPECT_NEAR(epoch.bands[1].tone_ratio, 1, 1e-9);
  EXPECT_NEAR(epoch.bands[1].agc(), 1 / std::sqrt(5), 1e-9);
  EXPECT_EQ(epoch.bands[2].interference_ratio, 0);
  // Signals of other bands do not change.
  Receiver quiet(options, 1);
  const ReceiverEpoch clear_epoch = observe_amid(quiet, four_systems(), 0, {});
  for (std::size_t i = 0; i < epoch.satellites.size(); ++i) {
    const SatelliteObservation &jammed = epoch.satellites[i], &free = clear_epoch.satellites[i];
    const double loss_db = *free.cn0_dbhz - *jammed.cn0_dbhz;
    if (jammed.id.system == System::GLONASS) {
      EXPECT_NEAR(loss_db, 0, 1e-9);
    } else {
      EXPECT_GT(loss_db, 5);
    }
  }
}

// A chip from early to late is too wide for Galileo's signal: irrelevant while only GPS is in the sky.
TEST(ReceiverInterference, OfSystemsThatAreNotThere) {
  ReceiverOptions options = plain();
  options.signal.dll.spacing_chips = 1;
  Receiver receiver(options, 1);
  const ReceiverEpoch epoch =
      observe_amid(receiver, one_satellite(), 0, {wave(Shape::Band, 1575.42e6, -130, 20e6)});
  EXPECT_GT(epoch.bands.size(), 1U);
}

// Outside the jammed 20 MHz the filter blocks the jammer: there the saturation of the stages before the
// filter is the effect. By Razavi's formula as written here.
TEST(ReceiverInterference, AStrongJammerSaturatesTheFrontEnd) {
  const double high = geodesy::radians(40);
  const orbit::FrozenSky sky(kPosition, {0, 1.5, 3, 4.5}, {high, high, high, high});
  ReceiverOptions options = plain();
  options.tracks = {"L1CA", "L5"};
  options.signal.antenna = signal::AntennaPattern("both", {{0, 0, 0}}, {{0, 0, 0}});
  options.signal.front_end_bandwidth_hz = 4e6;
  const auto lost_db = [&](double power_dbm, double centre_hz, std::size_t signal) {
    const auto cn0_dbhz = [&](std::vector<Interference> waves) {
      Receiver receiver(options, 1);
      const SatelliteObservation seen = observe_amid(receiver, sky, 0, std::move(waves)).satellites.back();
      return signal == 0 ? *seen.cn0_dbhz : *seen.more.front().cn0_dbhz;
    };
    return cn0_dbhz({}) - cn0_dbhz({wave(Shape::Band, centre_hz, power_dbm - 30, 20e6)});
  };
  constexpr double kOffset_hz = 1595e6;
  for (const double over_db : {-20.0, -6.0, 0.0, 6.0}) {
    const double left = 1 - 0.2175 * std::pow(10, over_db / 10);
    EXPECT_NEAR(lost_db(options.signal.front_end_compression_dbm + over_db, kOffset_hz, 0),
                -20 * std::log10(left), 1e-3)
        << over_db;
  }
  EXPECT_GT(lost_db(options.signal.front_end_compression_dbm + 6.7, kOffset_hz, 0), 50);
  EXPECT_NEAR(lost_db(0, kOffset_hz, 1), 0, 1e-9) << "the other band has an amplifier of its own";
  options.signal.front_end_compression_dbm = std::numeric_limits<double>::infinity();
  EXPECT_NEAR(lost_db(0, kOffset_hz, 0), 0, 1e-9);
}

// Only C/N0 matters: lost below the tracking threshold, found again after the jamming.
TEST(ReceiverInterference, LosesLockAndFindsItAgain) {
  ReceiverOptions options = plain();
  options.signal.lock.hold_s = 1;
  options.signal.lock.reacquisition_s = 2;
  Receiver receiver(options, 1);
  // White over 100 MHz: C/N0 48.3 minus the tracking threshold of 18 leaves 30.3 dB.
  const auto jam = [](double over_noise_db) {
    return wave(Shape::Band, 1575.42e6, kNoise + 80 + over_noise_db, 100e6);
  };
  for (int t = 0; t < 30; ++t) {
    std::vector<Interference> waves;
    if (t >= 5 && t < 10) waves = {jam(30.0)};
    if (t >= 10 && t < 20) waves = {jam(30.6)};
    const SatelliteObservation seen = observe_amid(receiver, one_satellite(), t, waves).satellites.front();
    // An update gives the state since the previous one: 2 s of search begin at 19 s.
    EXPECT_EQ(seen.lock == tracking::LockState::Tracking, t < 10 || t >= 21) << t;
    if (t >= 5 && t < 10) {
      EXPECT_NEAR(*seen.cn0_dbhz, clear_cn0_dbhz() - 30.0, 0.05);
    }
  }
}

// A drive past a jammer of 10 dBm 40 m from the road, with a long house in between for a while: 20 MHz of
// noise, by Friis and the density of C/A as written here.
TEST(ReceiverInterference, ADriveByAJammer) {
  city::City city;
  city.frame = kFrame;
  canyon::test::append_box(city.mesh, "house", city::Surface::Building, city::Material::Brick, {60, 20, -5},
                           {140, 25, 15});
  disturbance::FaultContext context;
  context.name = "jammer";
  context.begin = kTime;
  context.city = std::make_shared<const city::City>(city);
  context.rays = std::make_shared<const raytrace::RayScene>(city.mesh);
  disturbance::JammingOptions jammer;
  jammer.transmitter.course.position.east_m = 100;
  jammer.transmitter.course.position.north_m = 40;
  jammer.transmitter.course.position.up_m = 0;
  jammer.emissions.resize(1);
  disturbance::Jamming jamming(jammer, context);
  const double fraction = integral(
      -10e6, 10e6, [](double f) { return bpsk(f, 1.023e6); });  // fraction of C/A's power under the noise

  ReceiverOptions options = plain();
  options.signal.lock.reacquisition_s = 2;
  Receiver receiver(options, 1);
  bool lost = false, found_again = false;
  double max_db = 0, shadow_db = 1e9;
  for (int t = 0; t <= 160; ++t) {
    const Eigen::Vector3d point(-1500.0 + 20 * t, 0, 0);  // 20 m/s eastwards
    const Eigen::Vector3d antenna = kFrame.ecef_from_local(point);
    propagation::Arrival arrival;
    arrival.views = open_sky(one_satellite(), kTime + 1.0 * t, antenna);
    arrival.ecef_from_enu = kEcefFromEnu;
    arrival.antenna_enu = point;
    const propagation::Antenna moving{kTime + 1.0 * t, antenna, kEcefFromEnu * Eigen::Vector3d(20, 0, 0)};
    jamming.apply(moving, arrival);
    const SatelliteObservation seen =
        receiver.observe({moving, arrival, one_satellite(), {}}).satellites.front();
    const double far_m = (point - Eigen::Vector3d(100, 40, 0)).norm();
    const double over_noise = 10 - 30 - 20 * std::log10(4 * kPi * far_m / kWavelength_m) - kNoise;
    const double free_db = 10 * std::log10(1 + std::pow(10, over_noise / 10) * fraction / 20e6);
    const double loss_db = clear_cn0_dbhz() - *seen.cn0_dbhz;
    // The path crosses the house at its wall nearer to the road than to the jammer.
    const double crossing_m = point.x() + (100 - point.x()) * 22.5 / 40;
    if (crossing_m > 65 && crossing_m < 135) {
      shadow_db = std::min(shadow_db, loss_db);
      EXPECT_LT(loss_db, free_db - 10) << point.x();
    } else if (crossing_m < 40 || crossing_m > 160) {
      EXPECT_NEAR(loss_db, free_db, 0.5) << point.x();
      max_db = std::max(max_db, loss_db);
    }
    if (loss_db > 31) lost = true;
    if (lost && seen.lock == tracking::LockState::Tracking && point.x() > 300) found_again = true;
    EXPECT_FALSE(loss_db > 31 && seen.lock == tracking::LockState::Tracking) << point.x();
  }
  std::printf("most loss in sight %.1f dB, least behind the house %.1f dB\n", max_db, shadow_db);
  EXPECT_TRUE(lost);
  EXPECT_TRUE(found_again);
}

}  // namespace
}  // namespace canyon::receiver
