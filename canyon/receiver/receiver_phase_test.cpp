// Carrier phase and Doppler of a receiver with signal strength.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "canyon/receiver/receiver.hpp"
#include "tests/support/signal_scene.hpp"

namespace canyon::receiver {
namespace {

using namespace canyon::test;
using geodesy::kPi;
using raytrace::Containment;

// Noise-free in line of sight: (pseudorange - c tgd) / wavelength is the phase plus an integer, which is
// constant while locked, with moving satellites, antenna and clock.
TEST(ReceiverPhase, PhaseIsTheRangeWhileLocked) {
  ReceiverOptions options = plain();
  options.clock.bias_s = 1e-4;
  options.clock.drift = 1e-7;
  options.signal.antenna = signal::isotropic_antenna();
  Receiver receiver(options, 1);
  std::map<gnss::SatelliteId, double> ambiguities;
  int compared = 0;
  for (int i = 0; i < 50; ++i) {
    const double t = 0.2 * i;
    const Eigen::Vector3d antenna = kFrame.ecef_from_local({10 * t, -3 * t, 2});
    const Eigen::Vector3d velocity = kEcefFromEnu * Eigen::Vector3d(10, -3, 0);
    const std::vector<SatelliteView> views = open_sky(four_systems(), kTime + t, antenna);
    const ReceiverEpoch epoch = observe(receiver, four_systems(), kTime + t, views, antenna, velocity);
    for (const SatelliteView& view : views) {
      const SatelliteObservation& seen = *find(epoch, view.line.id);
      if (!seen.measurement) continue;
      ASSERT_TRUE(seen.measurement->carrier_phase_cycles && seen.measurement->phase_since);
      EXPECT_EQ(*seen.measurement->phase_since, kTime);
      EXPECT_EQ(seen.measurement->carrier_phase_sigma_cycles, 0);
      const double range_cycles =
          (seen.measurement->pseudorange_m - kSpeedOfLight * view.line.state.group_delay_s) *
          seen.measurement->carrier_frequency_hz / kSpeedOfLight;
      const double ambiguity = *seen.measurement->carrier_phase_cycles - range_cycles;
      EXPECT_NEAR(ambiguity, std::round(ambiguity), 1e-4);
      const auto [known, fresh] = ambiguities.emplace(view.line.id, std::round(ambiguity));
      EXPECT_EQ(known->second, std::round(ambiguity));
      compared += fresh ? 0 : 1;
    }
  }
  EXPECT_GT(compared, 500);
  // They are random integers.
  EXPECT_GT(std::abs(ambiguities.begin()->second - ambiguities.rbegin()->second), 1);
}

TEST(ReceiverPhase, IonosphereAdvancesThePhase) {
  const std::map<System, gnss::Klobuchar> klobuchar{
      {System::GPS,
       {{8.3819e-9, 1.4901e-8, -5.9605e-8, -5.9605e-8}, {8.8064e4, 3.2768e4, -1.9661e5, -1.9661e5}}}};
  const std::vector<SatelliteView> views = open_sky(one_satellite(), kTime, kAntenna);
  const auto measure = [&](bool ionosphere, bool troposphere) {
    ReceiverOptions options = plain();
    options.ionosphere = ionosphere;
    options.troposphere = troposphere;
    Receiver receiver(options, 1);
    return *observe_views(receiver, kTime, kAntenna, kAtRest, views, kEcefFromEnu, Containment::Free,
                          one_satellite(), klobuchar)
                .satellites.front()
                .measurement;
  };
  const positioning::Measurement none = measure(false, false);
  const positioning::Measurement ionosphere = measure(true, false);
  const positioning::Measurement troposphere = measure(false, true);
  const double i = ionosphere.pseudorange_m - none.pseudorange_m;
  const double s = troposphere.pseudorange_m - none.pseudorange_m;
  EXPECT_GT(i, 1);
  EXPECT_GT(s, 1);
  EXPECT_NEAR((*ionosphere.carrier_phase_cycles - *none.carrier_phase_cycles) * kWavelength_m, -i, 1e-6);
  EXPECT_NEAR((*troposphere.carrier_phase_cycles - *none.carrier_phase_cycles) * kWavelength_m, s, 1e-6);
}

// A mirror alone: the phase follows its detour over hundreds of wavelengths. The sum of a direct path and a
// weaker echo stays within asin(alpha) of the direct one.
TEST(ReceiverPhase, PhaseFollowsTheTrackedPath) {
  ReceiverOptions options = plain();
  Receiver receiver(options, 1);
  std::optional<double> before;
  for (int i = 0; i < 400; ++i) {
    const double excess = 20 + 0.3 * kWavelength_m * i;
    const SatelliteObservation seen =
        observe_one(receiver, 0.1 * i, [&](const orbit::LineOfSight&) -> std::vector<Path> {
          return {mirror_path({0, -1, 0}, excess, 0.5)};
        });
    const double offset = *seen.measurement->carrier_phase_cycles - excess / kWavelength_m;
    if (before) {
      EXPECT_NEAR(offset, *before, 1e-5);
    }
    before = offset;
    EXPECT_EQ(*seen.measurement->phase_since, kTime);
  }
  Receiver composite(options, 1), bare(options, 1);
  const double direct = *observe_one(bare, 0, clear).measurement->carrier_phase_cycles;
  double maximum = -1, least = 1;
  for (int i = 0; i < 400; ++i) {
    const double excess = 1 + kWavelength_m * i / 100;  // far below a chip: R is 1 within a percent
    const SatelliteObservation seen =
        observe_one(composite, 0.1 * i, [&](const orbit::LineOfSight& line) -> std::vector<Path> {
          return {direct_path(line), mirror_path({0, -1, 0}, excess, 0.5)};
        });
    const double off = *seen.measurement->carrier_phase_cycles - direct;
    maximum = std::max(maximum, off - std::round(off));
    least = std::min(least, off - std::round(off));
    EXPECT_EQ(*seen.measurement->phase_since, kTime);
  }
  EXPECT_NEAR(maximum, std::asin(0.5) / (2 * kPi), 1e-3);
  EXPECT_NEAR(least, -std::asin(0.5) / (2 * kPi), 1e-3);
}

TEST(ReceiverPhase, PhaseSlipsWhereTheSignalWas) {
  Receiver receiver(plain(), 1);
  const auto at = [&](double t, const PathsOf& paths) { return observe_one(receiver, t, paths); };
  const auto echo = [](std::uint64_t reflector) {
    return [reflector](const orbit::LineOfSight&) -> std::vector<Path> {
      return {mirror_path({0, -1, 0}, 30, 0.5, reflector)};
    };
  };
  const positioning::Measurement first = *at(0, clear).measurement;
  const positioning::Measurement second = *at(1, clear).measurement;
  EXPECT_EQ(*first.phase_since, *second.phase_since);
  EXPECT_NEAR(*first.carrier_phase_cycles, *second.carrier_phase_cycles, 1e-6);
  // A short gap is bridged by the hold, with a new phase.
  EXPECT_EQ(at(1.5, nothing).lock, tracking::LockState::Holding);
  const positioning::Measurement third = *at(1.8, clear).measurement;
  EXPECT_GT(*third.phase_since, *second.phase_since);
  const double slip = *third.carrier_phase_cycles - *second.carrier_phase_cycles;
  EXPECT_NEAR(slip, std::round(slip), 1e-5);
  EXPECT_GT(std::abs(slip), 0.5);
  // From the direct path to an echo, and from one mirror to another.
  const positioning::Measurement fourth = *at(2, echo(1)).measurement;
  EXPECT_EQ(*fourth.phase_since, kTime + 2.0);
  EXPECT_EQ(*at(3, echo(1)).measurement->phase_since, kTime + 2.0);
  EXPECT_EQ(*at(4, echo(2)).measurement->phase_since, kTime + 4.0);
}

TEST(ReceiverPhase, WeakSignalsHaveNoPhase) {
  ReceiverOptions options = plain();
  options.signal.phase_threshold_dbhz = 40;
  Receiver receiver(options, 1);
  const auto at = [&](double t, double fraction) {
    return *observe_one(receiver, t, [&](const orbit::LineOfSight&) -> std::vector<Path> {
              return {mirror_path({0, -1, 0}, 30, fraction)};
            }).measurement;
  };
  EXPECT_EQ(*at(0, 1).phase_since, kTime);
  EXPECT_EQ(*at(1, 0.5).phase_since, kTime);         // 42 dB-Hz
  const positioning::Measurement weak = at(2, 0.3);  // 38 dB-Hz
  EXPECT_FALSE(weak.carrier_phase_cycles || weak.phase_since);
  EXPECT_TRUE(weak.doppler_hz);
  EXPECT_EQ(*at(3, 1).phase_since, kTime + 3.0);
}

// For a receiver that drives along a wall's normal, Doppler is that of the stronger path.
TEST(ReceiverPhase, DopplerIsThatOfTheStrongestPath) {
  for (const double fraction : {0.8, 1.0}) {
    ReceiverOptions options = plain();
    Receiver receiver(options, 1);
    const SatelliteObservation seen = observe_one(
        receiver, 0,
        [&](const orbit::LineOfSight& line) -> std::vector<Path> {
          Path direct = direct_path(line);
          // Foliage: 10 m of it weaken the direct path by more than 0.1 dB and less than 10 dB.
          direct.foliage_depth_m = fraction == 1 ? 10 : 0;
          return {direct, mirror_path({0, -1, 0}, 20, fraction)};
        },
        kAntenna, kEcefFromEnu* Eigen::Vector3d(0, 5, 0));
    const double direct_doppler = 5 * std::cos(geodesy::radians(40)) / kWavelength_m;
    const double expected = fraction == 1 ? -5 / kWavelength_m : direct_doppler;
    EXPECT_NEAR(*seen.measurement->doppler_hz, expected, 0.02) << fraction;
  }
}

}  // namespace
}  // namespace canyon::receiver
