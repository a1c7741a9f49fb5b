// The receiver with signal strength: C/N0, code delay, noise.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "canyon/receiver/positioning/position_filter.hpp"
#include "canyon/receiver/receiver.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/signal_scene.hpp"

namespace canyon::receiver {
namespace {

using namespace canyon::test;
using geodesy::kPi;
using raytrace::Containment;

TEST(ReceiverSignal, ClearSkyHasTheLinkBudgetsStrengthAndNoError) {
  Receiver receiver(plain(), 1);
  const SatelliteObservation seen = observe_one(receiver, 0, clear);
  ASSERT_TRUE(seen.cn0_dbhz && seen.measurement);
  EXPECT_NEAR(*seen.cn0_dbhz, clear_cn0_dbhz(), 1e-6);
  EXPECT_NEAR(*seen.cn0_dbhz, 48.3, 0.05);
  EXPECT_EQ(*seen.measurement->cn0_dbhz, *seen.cn0_dbhz);
  EXPECT_EQ(seen.lock, tracking::LockState::Tracking);
  EXPECT_EQ(seen.visibility, Visibility::LOS);
  EXPECT_NEAR(seen.pseudorange_error_m, 0, 1e-6);
  EXPECT_EQ(seen.noise_m, 0);
  // Without noise, covariances are those of 1 m and of 0.1 Hz.
  EXPECT_EQ(seen.measurement->sigma_m, 1);
  EXPECT_EQ(seen.measurement->doppler_sigma_hz, 0.1);
}

TEST(ReceiverSignal, AnInstallationMovesAllSignalsAlike) {
  const std::vector<SatelliteView> views = open_sky(four_systems(), kTime, kAntenna);
  ReceiverOptions options = plain();
  Receiver nominal(options, 1);
  options.signal.installation = tracking::Installation::RoofWithSplitter;
  Receiver splitter(options, 1);
  options.signal.installation_sigma_db = 4;
  Receiver sampled(options, 1), other_seed(options, 2);
  const ReceiverEpoch a = observe(nominal, four_systems(), kTime, views);
  const ReceiverEpoch b = observe(splitter, four_systems(), kTime, views);
  const ReceiverEpoch c = observe(sampled, four_systems(), kTime, views);
  const ReceiverEpoch d = observe(other_seed, four_systems(), kTime, views);
  options.signal.installation_sigma_db = 0;
  options.signal.installation_db = -3.8;
  Receiver measured(options, 1);
  const ReceiverEpoch e = observe(measured, four_systems(), kTime, views);
  const double receiver_db = *c.satellites[0].cn0_dbhz - *b.satellites[0].cn0_dbhz;
  EXPECT_NE(receiver_db, 0);
  EXPECT_NE(*d.satellites[0].cn0_dbhz, *c.satellites[0].cn0_dbhz);
  for (std::size_t i = 0; i < a.satellites.size(); ++i) {
    EXPECT_NEAR(*b.satellites[i].cn0_dbhz - *a.satellites[i].cn0_dbhz, -9, 1e-9);
    EXPECT_NEAR(*c.satellites[i].cn0_dbhz - *b.satellites[i].cn0_dbhz, receiver_db, 1e-9);
    EXPECT_NEAR(*e.satellites[i].cn0_dbhz - *a.satellites[i].cn0_dbhz, -3.8, 1e-9);
  }
}

TEST(ReceiverSignal, SystemsAndSatellitesDifferAsAsked) {
  const std::vector<SatelliteView> views = open_sky(four_systems(), kTime, kAntenna);
  ReceiverOptions options = plain();
  Receiver same(options, 1);
  options.signal.offset_db["BeiDou"] = -3.5;
  Receiver shifted(options, 1);
  options.signal.satellite_sigma_db = 2;
  Receiver scattered(options, 1);
  options.name = "neighbour";
  Receiver neighbour(options, 1);
  const ReceiverEpoch a = observe(same, four_systems(), kTime, views);
  const ReceiverEpoch b = observe(shifted, four_systems(), kTime, views);
  const ReceiverEpoch c = observe(scattered, four_systems(), kTime, views);
  const ReceiverEpoch d = observe(neighbour, four_systems(), kTime, views);
  for (std::size_t i = 0; i < a.satellites.size(); ++i) {
    const double offset = a.satellites[i].id.system == System::BeiDou ? -3.5 : 0;
    EXPECT_NEAR(*b.satellites[i].cn0_dbhz - *a.satellites[i].cn0_dbhz, offset, 1e-9);
    EXPECT_NE(*c.satellites[i].cn0_dbhz, *b.satellites[i].cn0_dbhz);
    // A satellite's power does not depend on the receiver.
    EXPECT_EQ(*c.satellites[i].cn0_dbhz, *d.satellites[i].cn0_dbhz);
  }
  double square = 0;
  int count = 0;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    Receiver receiver(options, seed);
    const double constant = *observe_one(receiver, 0, clear).cn0_dbhz - clear_cn0_dbhz();
    Receiver later(options, seed);
    EXPECT_EQ(*observe_one(later, 60, clear).cn0_dbhz, constant + clear_cn0_dbhz());
    square += constant * constant;
    ++count;
  }
  EXPECT_NEAR(square / count, 4, 5 * 4 * std::sqrt(2.0 / count));
}

/// Kaplan & Hegarty 5.4 for an early-late power loop on BPSK with infinite bandwidth, by hand [m].
double code_sigma_m(double cn0_dbhz, double d = 0.5, double bn = 1, double t = 0.02) {
  const double cn0 = std::pow(10, cn0_dbhz / 10);
  return kChip_m * std::sqrt(bn * (1 - bn * t / 2) * d / (2 * cn0) * (1 + 2 / ((2 - d) * t * cn0)));
}

TEST(ReceiverSignal, NoiseIsTheLoopsFormulas) {
  ReceiverOptions options = plain();
  options.signal.loop_noise = true;
  options.signal.offset_db["GPS"] = -15;  // 33.3 dB-Hz: the squaring loss matters
  Receiver receiver(options, 4);
  const double cn0_dbhz = clear_cn0_dbhz() - 15;
  const double cn0 = std::pow(10, cn0_dbhz / 10);
  const double doppler_sigma = std::sqrt(4 * 5 / cn0 * (1 + 1 / (0.02 * cn0))) / (2 * kPi * 0.02);
  const double phase_sigma = std::sqrt(15 / cn0 * (1 + 1 / (2 * 0.02 * cn0))) / (2 * kPi);
  double code = 0, doppler = 0, phase = 0;
  double quiet_phase = 0, quiet_doppler = 0;
  {
    ReceiverOptions quiet = options;
    quiet.signal.loop_noise = false;
    Receiver silent(quiet, 4);
    const positioning::Measurement m = *observe_one(silent, 0, clear).measurement;
    quiet_phase = *m.carrier_phase_cycles;
    quiet_doppler = *m.doppler_hz;
  }
  constexpr int kCount = 4000;
  for (int i = 0; i < kCount; ++i) {
    // 4 Bn tau >= 20: independent.
    const SatelliteObservation seen = observe_one(receiver, 5.0 * i, clear);
    ASSERT_TRUE(seen.measurement && seen.measurement->carrier_phase_cycles);
    EXPECT_NEAR(seen.measurement->sigma_m, code_sigma_m(cn0_dbhz), 1e-9);
    EXPECT_NEAR(seen.measurement->doppler_sigma_hz, doppler_sigma, 1e-9);
    EXPECT_NEAR(seen.measurement->carrier_phase_sigma_cycles, phase_sigma, 1e-9);
    EXPECT_EQ(seen.noise_m, seen.pseudorange_error_m);
    code += seen.noise_m * seen.noise_m / kCount;
    doppler += std::pow(*seen.measurement->doppler_hz - quiet_doppler, 2) / kCount;
    phase += std::pow(*seen.measurement->carrier_phase_cycles - quiet_phase, 2) / kCount;
  }
  const double five = 5 * std::sqrt(2.0 / kCount);
  EXPECT_NEAR(code / std::pow(code_sigma_m(cn0_dbhz), 2), 1, five);
  EXPECT_NEAR(doppler / std::pow(doppler_sigma, 2), 1, five);
  EXPECT_NEAR(phase / std::pow(phase_sigma, 2), 1, five);
  std::printf("%.1f dB-Hz: code %.3f m (formula %.3f), Doppler %.3f Hz (%.3f), phase %.4f cycles (%.4f)\n",
              cn0_dbhz, std::sqrt(code), code_sigma_m(cn0_dbhz), std::sqrt(doppler), doppler_sigma,
              std::sqrt(phase), phase_sigma);
}

// OU noise and loop noise are independent: roots of the sums of squares.
TEST(ReceiverSignal, DeviationsOfAllNoisesAddAsSquares) {
  ReceiverOptions options = plain();
  options.signal.loop_noise = true;
  options.noise.enabled = true;
  options.noise.ou.theta_per_s = 0.5;
  options.noise.ou.sigma_m_per_sqrt_s = 2;  // 2 m
  options.noise.doppler_sigma_hz = 0.4;
  Receiver receiver(options, 4);
  const positioning::Measurement m = *observe_one(receiver, 0, clear).measurement;
  EXPECT_NEAR(m.sigma_m, std::hypot(2, code_sigma_m(clear_cn0_dbhz())), 1e-9);
  const double cn0 = std::pow(10, clear_cn0_dbhz() / 10);
  EXPECT_NEAR(m.doppler_sigma_hz,
              std::hypot(0.4, std::sqrt(20 / cn0 * (1 + 1 / (0.02 * cn0))) / (2 * kPi * 0.02)), 1e-9);
}

// The code error of one mirror at all phases: the detour increases by a wavelength in steps. Envelope of an
// early-late loop on BPSK, docs/tracking.md (a row for each range of delay).
TEST(ReceiverSignal, OneReflectionFollowsTheMultipathEnvelope) {
  constexpr double kAlpha = 0.5, kSpacing = 0.5;
  const auto envelope = [](double alpha, double x) {
    if (x <= (1 + alpha) * kSpacing / 2) return alpha * x / (1 + alpha);
    if (x <= 1 - kSpacing / 2 + alpha * kSpacing / 2) return alpha * kSpacing / 2;
    if (x <= 1 + kSpacing / 2) return alpha * (1 + kSpacing / 2 - x) / (2 - alpha);
    return 0.0;
  };
  ReceiverOptions options = plain();
  options.signal.dll.spacing_chips = kSpacing;
  for (const double x : {0.05, 0.2, 0.5, 0.8, 1.1, 1.4}) {
    double maximum = -1e9, least = 1e9;
    constexpr int kPhases = 720;
    for (int i = 0; i < kPhases; ++i) {
      const double excess = x * kChip_m + kWavelength_m * i / kPhases;
      Receiver receiver(options, 1);
      const SatelliteObservation seen =
          observe_one(receiver, 0, [&](const orbit::LineOfSight& line) -> std::vector<Path> {
            return {direct_path(line), mirror_path({0, -1, 0}, excess, kAlpha)};
          });
      ASSERT_TRUE(seen.measurement);
      EXPECT_EQ(seen.visibility, Visibility::LOSMultipath);
      EXPECT_EQ(seen.excess_m, seen.pseudorange_error_m);
      maximum = std::max(maximum, seen.excess_m);
      least = std::min(least, seen.excess_m);
    }
    // Metal reflects 0.9999 of a wave, a wavelength is 7e-4 chips, and phases are half a degree apart.
    EXPECT_NEAR(maximum, envelope(kAlpha, x) * kChip_m, 0.15) << x;
    EXPECT_NEAR(least, envelope(-kAlpha, x) * kChip_m, 0.15) << x;
    std::printf("detour %.2f chips: error %.2f to %.2f m, envelope %.2f to %.2f m\n", x, least, maximum,
                envelope(-kAlpha, x) * kChip_m, envelope(kAlpha, x) * kChip_m);
  }
}

// In motion the echo rotates 2 times a second, against a loop of 0.05 Hz: only its power remains, with the
// bias alpha^2 d (1 - x) / (2 - d - alpha^2 d) of docs/tracking.md; integration scales alpha by sinc(pi f T).
TEST(ReceiverSignal, MotionAveragesTheMultipathError) {
  ReceiverOptions options = plain();
  options.signal.dll.spacing_chips = 0.5;
  options.signal.dll.loop_bandwidth_hz = 0.05;
  const double x = 0.5, d = 0.5;
  const double rotation = kPi * 2 * 0.02;
  const double power = std::pow(0.5 * std::sin(rotation) / rotation, 2);
  const double expected = power * d * (1 - x) / (2 - d - power * d) * kChip_m;
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    Receiver receiver(options, seed);
    const SatelliteObservation seen = observe_one(
        receiver, 0,
        [&](const orbit::LineOfSight& line) -> std::vector<Path> {
          Path direct = direct_path(line);
          return {direct, mirror_path(-direct.arrival, x * kChip_m, 0.5)};
        },
        kAntenna,
        // e - a is twice the direction: the detour grows by two wavelengths a second.
        kWavelength_m* one_satellite().satellites().size() *
            orbit::line_of_sight(one_satellite(), one_satellite().satellites().front(), kTime, kAntenna)
                ->direction_ecef);
    // The rest of the coherent part moves the error by at most d / 2 sqrt(2.5e-4) chips around it.
    EXPECT_NEAR(seen.excess_m, expected, 1.0) << seed;
  }
  EXPECT_GT(expected, 5);
}

TEST(ReceiverSignal, EchoAloneIsMeasuredAtItsDetour) {
  for (const double fraction : {1.0, 0.3, 0.1}) {
    for (const double excess : {0.5, 17.0, 120.0, 280.0}) {
      Receiver receiver(plain(), 1);
      const SatelliteObservation seen =
          observe_one(receiver, 0, [&](const orbit::LineOfSight&) -> std::vector<Path> {
            return {mirror_path({0, -1, 0}, excess, fraction)};
          });
      ASSERT_TRUE(seen.measurement);
      EXPECT_EQ(seen.visibility, Visibility::NLOS);
      EXPECT_NEAR(seen.excess_m, excess, 1e-6);
      EXPECT_NEAR(seen.pseudorange_error_m, excess, 1e-6);
      // Metal: within 2 mdB of a perfect mirror (fresnel_test.cpp).
      EXPECT_NEAR(*seen.cn0_dbhz, clear_cn0_dbhz() + 20 * std::log10(fraction), 0.02);
    }
  }
}

// An edge near the direct path: the field at the boundary of a shadow is half (-6.02 dB), the first Fresnel
// maximum in the light has 1.3704 of the intensity at nu = -1.2172 (Cornu's spiral), for any seed. In the
// shadow at nu = 1: 6.9 + 20 log10(sqrt(0.9^2 + 1) + 0.9) = 13.9 dB (ITU-R P.526-15, equation 31).
TEST(ReceiverSignal, EdgesMakeTheBoundaryOfAShadow) {
  const auto level_db = [](double nu, std::uint64_t seed) {
    Receiver receiver(plain(), seed);
    const SatelliteObservation seen = observe_one(receiver, 0, [&](const orbit::LineOfSight& line) {
      std::vector<Path> paths;
      if (nu <= 0) paths.push_back(direct_path(line));
      Path edge = direct_path(line);
      edge.kind = PathKind::Diffracted;
      edge.excess_m = kWavelength_m * nu * nu / 4;
      edge.edge_nu = nu;
      edge.reflector = 8;
      paths.push_back(edge);
      return paths;
    });
    return *seen.cn0_dbhz - clear_cn0_dbhz();
  };
  for (std::uint64_t seed = 1; seed < 6; ++seed) {
    EXPECT_NEAR(level_db(-1e-4, seed), -6.02, 0.01);
    EXPECT_NEAR(level_db(1e-4, seed), -6.02, 0.01);
    EXPECT_NEAR(level_db(-1.2172, seed), 10 * std::log10(1.3704), 0.01);
    EXPECT_NEAR(level_db(1, seed), -6.9 - 20 * std::log10(std::sqrt(0.81 + 1) + 0.9), 0.1);
  }
}

TEST(ReceiverSignal, AntennasHearEchoesDifferently) {
  const auto echo_db = [](const AntennaPattern& antenna) {
    ReceiverOptions options = plain();
    options.signal.antenna = antenna;
    const auto mirror = [](const orbit::LineOfSight&) -> std::vector<Path> {
      return {mirror_path({0, -std::sqrt(0.75), 0.5}, 30, 1)};
    };
    Receiver one(options, 1), other(options, 1);
    return *observe_one(one, 0, mirror).cn0_dbhz - *observe_one(other, 0, clear).cn0_dbhz;
  };
  // A mirror reverses the wave's hand: an antenna's LHCP gain at 30 over its RHCP gain at 40 degrees.
  EXPECT_LT(echo_db(signal::isotropic_antenna()), -60);
  EXPECT_NEAR(echo_db(both_hands()), 0, 0.02);
  for (const AntennaPattern& antenna :
       {signal::patch_antenna(), signal::survey_antenna(), signal::phone_antenna()}) {
    const double expected = antenna.gain(geodesy::radians(30), gnss::kL1_hz).lhcp_dbic -
                            antenna.gain(geodesy::radians(40), gnss::kL1_hz).rhcp_dbic;
    EXPECT_NEAR(echo_db(antenna), expected, 0.05) << antenna.name();
  }
  EXPECT_GT(echo_db(signal::phone_antenna()), echo_db(signal::survey_antenna()) + 10);
}

TEST(ReceiverSignal, StatedStrengthIsNoisyAndInSteps) {
  ReceiverOptions options = plain();
  options.signal.cn0_step_db = 1;
  Receiver stepped(options, 1);
  const SatelliteObservation seen = observe_one(stepped, 0, clear);
  EXPECT_EQ(*seen.measurement->cn0_dbhz, 48);
  EXPECT_NEAR(*seen.cn0_dbhz, clear_cn0_dbhz(), 1e-6);
  options.signal.cn0_step_db = 0;
  options.signal.cn0_sigma_db = 1.5;
  Receiver noisy(options, 1);
  double mean = 0, square = 0;
  constexpr int kCount = 4000;
  for (int i = 0; i < kCount; ++i) {
    const double off = *observe_one(noisy, i, clear).measurement->cn0_dbhz - clear_cn0_dbhz();
    mean += off / kCount;
    square += off * off / kCount;
  }
  EXPECT_NEAR(mean, 0, 5 * 1.5 / std::sqrt(kCount));
  EXPECT_NEAR(square, 2.25, 5 * 2.25 * std::sqrt(2.0 / kCount));
}

// At rest the C/N0 of a diffuse signal alone is that of one exponential sample: mean P, median P ln 2. At its
// mean detour, without a phase.
TEST(ReceiverSignal, DiffuseSignalsAreWeakAndRayleigh) {
  ReceiverOptions options = plain();
  options.signal.lock.acquisition_threshold_dbhz = -30;
  options.signal.lock.tracking_threshold_dbhz = -30;
  constexpr double kPower = 3e-3;
  const auto scattered = [](const orbit::LineOfSight&) -> std::vector<Path> {
    return {diffuse_path({0, -1, 0}, 45, kPower)};
  };
  double mean = 0, square = 0;
  int below = 0;
  constexpr int kCount = 3000;
  for (std::uint64_t seed = 0; seed < kCount; ++seed) {
    Receiver receiver(options, seed);
    const SatelliteObservation seen = observe_one(receiver, 0, scattered);
    ASSERT_TRUE(seen.measurement);
    EXPECT_EQ(seen.visibility, Visibility::NLOS);
    EXPECT_NEAR(seen.excess_m, 45, 1e-5);
    EXPECT_FALSE(seen.measurement->carrier_phase_cycles);
    const double power = std::pow(10, (*seen.cn0_dbhz - clear_cn0_dbhz()) / 10) / kPower;
    mean += power / kCount;
    square += power * power / kCount;
    below += power < std::log(2.0);
    if (seed < 5) {
      EXPECT_NEAR(*observe_one(receiver, 1, scattered).cn0_dbhz, *seen.cn0_dbhz, 1e-9);
    }
  }
  EXPECT_NEAR(mean, 1, 5 / std::sqrt(kCount));
  EXPECT_NEAR(square, 2, 5 * std::sqrt(20.0 / kCount));
  EXPECT_NEAR(below, kCount / 2.0, 5 * std::sqrt(kCount) / 2);
}

// In motion a loop averages many fades: 2 m/s at 0.28 wavelengths make x = T / tau_c = 0.754 in 20 ms, the
// loop of 1 Hz keeps 4 / (4 + 37.7) of the fading. Mean power is that of the integration, 2 (1/x - (1 - e^-x)
// / x^2).
TEST(ReceiverSignal, DiffuseSignalsInMotionHaveTheirMeanStrength) {
  ReceiverOptions options = plain();
  options.signal.lock.acquisition_threshold_dbhz = -30;
  options.signal.lock.tracking_threshold_dbhz = -30;
  constexpr double kPower = 3e-3, kSpeed = 2;
  const double x = kSpeed * 0.02 / (0.27884 * kWavelength_m);
  const double integrated = 2 * (1 / x - (1 - std::exp(-x)) / (x * x));
  Receiver receiver(options, 1);
  const Eigen::Vector3d velocity = kEcefFromEnu * Eigen::Vector3d(kSpeed, 0, 0);
  double mean = 0, square = 0;
  constexpr int kCount = 3000;
  for (int i = 0; i < kCount; ++i) {
    const SatelliteObservation seen = observe_one(
        receiver, 0.1 * i,
        [](const orbit::LineOfSight&) -> std::vector<Path> {
          return {diffuse_path({0, -1, 0}, 45, kPower)};
        },
        kAntenna + 0.1 * i * velocity, velocity);
    const double power = std::pow(10, (*seen.cn0_dbhz - clear_cn0_dbhz()) / 10) / kPower;
    mean += power / kCount;
    square += power * power / kCount;
  }
  // 600 m farther the satellite is 3e-5 rad lower.
  EXPECT_NEAR(mean, integrated, 0.02);
  // The ratio of deviation to mean is the fraction of fading that the loop keeps; for an exponential power
  // over n samples the deviation's is sqrt(2 / n).
  const double fraction = 4 / (4 + x / 0.02);
  EXPECT_NEAR(std::sqrt(square - mean * mean) / mean, fraction, 5 * fraction * std::sqrt(2.0 / kCount));
  std::printf("diffuse at 2 m/s: mean power %.4f (closed form %.4f), deviation %.3f of it\n", mean,
              integrated, std::sqrt(square - mean * mean) / mean);
}

TEST(ReceiverSignal, SameSeedSameNumbersWhateverRunsBeside) {
  ReceiverOptions options = plain();
  options.noise.enabled = true;
  options.signal.loop_noise = true;
  options.signal.cn0_sigma_db = 1;
  options.signal.satellite_sigma_db = 1;
  Receiver a(options, 7), b(options, 7), other(options, 8), fewer(options, 7);
  for (int i = 0; i < 5; ++i) {
    const GpsTime time = kTime + 1.0 * i;
    std::vector<SatelliteView> views = open_sky(four_systems(), time, kAntenna);
    for (SatelliteView& view : views) {
      std::vector<Path> paths = view.paths.paths;
      paths.push_back(mirror_path({0, -1, 0}, 25, 0.4));
      paths.push_back(diffuse_path({1, 0, 0}, 45, 1e-2));
      arrive(view, paths);
    }
    const ReceiverEpoch ea = observe(a, four_systems(), time, views);
    const ReceiverEpoch eo = observe(other, four_systems(), time, views);
    const ReceiverEpoch eb = observe(b, four_systems(), time, views);
    for (std::size_t k = 0; k < views.size(); k += 2) arrive(views[k], {});
    const ReceiverEpoch ef = observe(fewer, four_systems(), time, views);
    EXPECT_EQ(ea.fix.position_ecef, eb.fix.position_ecef);
    int compared = 0;
    for (std::size_t k = 0; k < ea.satellites.size(); ++k) {
      if (!ea.satellites[k].measurement) continue;
      const positioning::Measurement& ma = *ea.satellites[k].measurement;
      const positioning::Measurement& mb = *eb.satellites[k].measurement;
      EXPECT_EQ(ma.pseudorange_m, mb.pseudorange_m);
      EXPECT_EQ(*ma.doppler_hz, *mb.doppler_hz);
      EXPECT_EQ(*ma.carrier_phase_cycles, *mb.carrier_phase_cycles);
      EXPECT_EQ(*ma.cn0_dbhz, *mb.cn0_dbhz);
      EXPECT_NE(ma.pseudorange_m, eo.satellites[k].measurement->pseudorange_m);
      if (!ef.satellites[k].measurement) continue;
      EXPECT_EQ(ma.pseudorange_m, ef.satellites[k].measurement->pseudorange_m);
      EXPECT_EQ(*ma.doppler_hz, *ef.satellites[k].measurement->doppler_hz);
      ++compared;
    }
    EXPECT_GT(compared, 5);
  }
}

// AR(1) at 1 Hz with phi = e^(-4 Bn) over 6 * 2000 samples, at any rate of observation; five deviations.
TEST(ReceiverSignal, NoiseStatisticsDoNotDependOnTheRate) {
  ReceiverOptions options = plain();
  options.signal.loop_noise = true;
  options.signal.dll.loop_bandwidth_hz = 0.125;
  const double phi = std::exp(-0.5);
  const double n = 6 * 2000 * (1 - phi * phi) / (1 + phi * phi);
  const std::vector<SatelliteView> views = open_sky(six_satellites(), kTime, kAntenna);
  for (const int rate : {1, 10}) {
    Receiver receiver(options, 3);
    double variance = 0, product = 0;
    int pairs = 0;
    std::vector<double> last;
    for (int i = 0; i <= 2000 * rate; ++i) {
      const GpsTime time = kTime + static_cast<double>(i) / rate;
      const ReceiverEpoch epoch = observe(receiver, six_satellites(), time, views);
      if (i % rate != 0) continue;
      std::vector<double> now;
      for (const SatelliteObservation& seen : epoch.satellites)
        now.push_back(seen.noise_m / code_sigma_m(*seen.cn0_dbhz, 0.5, 0.125));
      for (std::size_t k = 0; k < last.size(); ++k) {
        variance += now[k] * now[k];
        product += now[k] * last[k];
        ++pairs;
      }
      last = now;
    }
    EXPECT_NEAR(variance / pairs, 1, 5 * std::sqrt(2 / n)) << rate;
    EXPECT_NEAR(product / pairs, phi, 5 * std::sqrt(2 / n)) << rate;
  }
}

TEST(ReceiverSignal, ElevationMaskHidesMeasurementsOnly) {
  ReceiverOptions options = plain();
  options.fix.elevation_mask_rad = geodesy::radians(41);
  Receiver receiver(options, 1);
  const SatelliteObservation seen = observe_one(receiver, 0, clear);
  EXPECT_FALSE(seen.above_mask || seen.measurement);
  EXPECT_EQ(seen.lock, tracking::LockState::Tracking);
  EXPECT_TRUE(seen.cn0_dbhz);
}

// A C/N0 mask belongs to the fix: weaker signals are measured and not used.
TEST(ReceiverSignal, StrengthMaskKeepsWeakSignalsOutOfTheFix) {
  ReceiverOptions options = plain();
  options.fix.elevation_mask_rad = 0;
  options.fix.cn0_mask_dbhz = 40;
  options.signal.lock.acquisition_threshold_dbhz = options.signal.lock.tracking_threshold_dbhz = 10;
  Receiver receiver(options, 1);
  std::vector<SatelliteView> views = open_sky(four_systems(), kTime, kAntenna);
  for (std::size_t k = 0; k < views.size(); k += 4) {
    arrive(views[k], {mirror_path({0, -1, 0}, 30, 0.1)});
  }
  const ReceiverEpoch epoch = observe(receiver, four_systems(), kTime, views);
  ASSERT_TRUE(epoch.fix.solved());
  int weak = 0;
  for (const SatelliteObservation& seen : epoch.satellites) {
    ASSERT_TRUE(seen.measurement);
    EXPECT_EQ(seen.used, *seen.cn0_dbhz >= 40) << gnss::to_string(seen.id);
    weak += *seen.cn0_dbhz < 40;
  }
  EXPECT_GT(weak, 5);
  EXPECT_LT((epoch.fix.position_ecef - kAntenna).norm(), 1e-4);
}

// The filter's result replaces the fix; with four remaining satellites of one system it continues, while a
// fix that needs five has none.
TEST(ReceiverSignal, PositionFilterAnswersForTheFix) {
  ReceiverOptions options = plain();
  options.signal.loop_noise = true;
  options.fix.min_satellites = 5;
  ReceiverOptions filtered = options;
  filtered.filter.enabled = true;
  Receiver bare(options, 1), smooth(filtered, 1);
  positioning::PositionFilter filter(filtered.filter, filtered.fix);
  for (int i = 0; i < 20; ++i) {
    const GpsTime time = kTime + 1.0 * i;
    std::vector<SatelliteView> views = open_sky(six_satellites(), time, kAntenna);
    if (i == 15) {
      arrive(views[0], {});
      arrive(views[1], {});
    }
    const ReceiverEpoch epoch = observe(bare, six_satellites(), time, views);
    const ReceiverEpoch result = observe(smooth, six_satellites(), time, views);
    std::vector<positioning::Measurement> measurements;
    for (const SatelliteObservation& seen : result.satellites) {
      if (seen.measurement) measurements.push_back(*seen.measurement);
    }
    const positioning::Fix expected =
        filter.update(result.receiver_time, measurements, six_satellites(), epoch.fix);
    EXPECT_EQ(epoch.fix.solved(), i != 15) << i;
    ASSERT_TRUE(result.fix.solved()) << i;
    EXPECT_EQ(result.fix.position_ecef, expected.position_ecef) << i;
    if (i > 0) {
      EXPECT_NE(result.fix.position_ecef, epoch.fix.position_ecef) << i;
    }
    for (const SatelliteObservation& seen : result.satellites) {
      EXPECT_EQ(seen.used,
                std::find(expected.used.begin(), expected.used.end(), seen.id) != expected.used.end());
    }
  }
}

// The measurement equation with the documented stream of noise, bit for bit, for any signal options.
TEST(ReceiverSignal, SwitchedOffNothingOfItShows) {
  ReceiverOptions options;
  options.clock.bias_s = 3.3e-4;
  ReceiverOptions odd = options;
  odd.signal.satellite_sigma_db = 5;
  odd.signal.cn0_sigma_db = 3;
  odd.signal.lock.cold_acquisition_s = 1e6;
  odd.signal.phase_threshold_dbhz = 0;
  Receiver receiver(options, 9), other(odd, 9);
  std::map<gnss::SatelliteId, tracking::OuProcess> noises;
  for (int i = 0; i < 5; ++i) {
    const GpsTime time = kTime + 1.0 * i;
    std::vector<SatelliteView> views = open_sky(four_systems(), time, kAntenna);
    arrive(views[1], {});
    arrive(views[2], {mirror_path({0, -1, 0}, 31, 0.1, 1), mirror_path({0, 1, 0}, 70, 1, 2)});
    const ReceiverEpoch epoch = observe(receiver, four_systems(), time, views);
    const ReceiverEpoch same = observe(other, four_systems(), time, views);
    EXPECT_EQ(epoch.fix.position_ecef, same.fix.position_ecef);
    for (const SatelliteView& view : views) {
      const SatelliteObservation& seen = *find(epoch, view.line.id);
      const SatelliteObservation& twin = *find(same, view.line.id);
      EXPECT_EQ(seen.lock,
                view.paths.received() ? tracking::LockState::Tracking : tracking::LockState::Searching);
      EXPECT_EQ(seen.excess_m, view.paths.tracked_excess_m());
      EXPECT_FALSE(seen.cn0_dbhz || twin.cn0_dbhz);
      ASSERT_EQ(seen.measurement.has_value(), view.paths.received() && seen.above_mask);
      if (!seen.measurement) continue;
      tracking::OuProcess& noise =
          noises
              .emplace(view.line.id, tracking::OuProcess(
                                         {}, RandomStream(9, "/" + gnss::to_string(view.line.id) + "/code")))
              .first->second;
      const double error = noise.advance(1);
      EXPECT_EQ(seen.noise_m, error);
      EXPECT_DOUBLE_EQ(seen.measurement->pseudorange_m,
                       view.line.range_m + view.paths.tracked_excess_m() +
                           kSpeedOfLight * (epoch.clock_bias_s -
                                            (view.line.state.clock_bias_s - view.line.state.group_delay_s)) +
                           0.0 + error);
      EXPECT_EQ(seen.measurement->pseudorange_m, twin.measurement->pseudorange_m);
      EXPECT_EQ(*seen.measurement->doppler_hz, *twin.measurement->doppler_hz);
      EXPECT_EQ(seen.measurement->sigma_m, tracking::OuOptions().standard_deviation_m());
      EXPECT_FALSE(seen.measurement->cn0_dbhz || seen.measurement->carrier_phase_cycles ||
                   seen.measurement->phase_since);
    }
  }
}

TEST(ReceiverSignal, BadOptionsNameTheReceiver) {
  ReceiverOptions options = plain();
  options.name = "rover";
  options.signal.cn0_step_db = -1;
  EXPECT_THAT(test::refusal([&] { Receiver receiver(options, 1); }),
              testing::AllOf(testing::HasSubstr("rover"), testing::HasSubstr("cn0_step_db")));
  options.signal.cn0_step_db = 0;
  options.filter.coast_s = 0;
  EXPECT_THAT(test::refusal([&] { Receiver receiver(options, 1); }),
              testing::AllOf(testing::HasSubstr("rover"), testing::HasSubstr("coast_s")));
  // A BOC's side peaks are half a chip away: GPS can use correlators a chip apart, Galileo cannot.
  options = plain();
  options.name = "rover";
  options.signal.dll.spacing_chips = 1;
  Receiver receiver(options, 1);
  EXPECT_TRUE(observe_one(receiver, 0, clear).measurement);
  EXPECT_THAT(test::refusal([&] {
                static_cast<void>(
                    observe(receiver, four_systems(), kTime, open_sky(four_systems(), kTime, kAntenna)));
              }),
              testing::AllOf(testing::HasSubstr("rover"), testing::HasSubstr("Galileo"),
                             testing::HasSubstr("reduce their spacing")));
}

}  // namespace
}  // namespace canyon::receiver
