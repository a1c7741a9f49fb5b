// Two signals of one code in the correlators of a receiver, and the response of its loops.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/paths/disturbance/faults/spoofing.hpp"
#include "canyon/paths/signal/path_strength.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/spoofing_check.hpp"
#include "tests/support/signal_scene.hpp"

namespace canyon::receiver {
namespace {

using namespace canyon::test;
using disturbance::Spoofing;
using disturbance::SpoofingOptions;

/// An open field with the antenna at its origin.
disturbance::FaultContext field(std::uint64_t seed = 1) {
  disturbance::FaultContext context;
  context.name = "spoofer";
  context.begin = kTime;
  context.seed = seed;
  context.sky = std::make_shared<const CircularSky>(
      std::vector<System>{System::GPS, System::GLONASS, System::Galileo, System::BeiDou});
  city::City city;
  city.frame = kFrame;
  context.city = std::make_shared<const city::City>(city);
  context.rays = std::make_shared<const raytrace::RayScene>(city.mesh);
  return context;
}

/// 100 m east, 20 m above the antenna.
SpoofingOptions neighbour() {
  SpoofingOptions options;
  options.transmitter.course.position.east_m = 100;
  options.transmitter.course.position.north_m = 0;
  options.transmitter.course.position.up_m = 20;
  return options;
}

struct Observed {
  ReceiverEpoch epoch;
  propagation::Arrival arrival;
};

/// A receiver at rest in the open, 10 s before the spoofer begins and then for `seconds`.
class Victim {
 public:
  Victim(const SpoofingOptions& spoofing, const ReceiverOptions& options, std::uint64_t seed = 1,
         double step_s = 1)
      : context_(field(seed)), spoofing_(spoofing, context_), receiver_(options, seed), step_s_(step_s) {
    for (now_s_ = -10; now_s_ < 0; now_s_ += step_s_) (void)observe(false);
  }
  Observed after(double seconds) {
    Observed seen;
    for (; now_s_ <= seconds; now_s_ += step_s_) seen = observe(true);
    return seen;
  }

 private:
  Observed observe(bool spoofed) {
    Observed seen;
    seen.arrival.views = open_sky(*context_.sky, kTime + now_s_, kAntenna);
    seen.arrival.ecef_from_enu = kEcefFromEnu;
    const propagation::Antenna antenna{kTime + now_s_, kAntenna, kAtRest};
    if (spoofed) spoofing_.apply(antenna, seen.arrival);
    for (SatelliteView& view : seen.arrival.views) view.paths.arrange();
    std::sort(seen.arrival.views.begin(), seen.arrival.views.end(),
              [](const auto& a, const auto& b) { return a.line.id < b.line.id; });
    seen.epoch = receiver_.observe({antenna, seen.arrival, *context_.sky, {}});
    return seen;
  }

  disturbance::FaultContext context_;
  Spoofing spoofing_;
  Receiver receiver_;
  double step_s_, now_s_ = 0;
};

Eigen::Vector3d fix_enu(const ReceiverEpoch& epoch) {
  return kFrame.local_from_ecef(epoch.fix.position_ecef);
}

/// Largest error of a code by a second signal of `ratio` of its amplitude, any phase: ratio d / 2 chips.
double envelope_m(double ratio) {
  return ratio * plain().signal.dll.spacing_chips / 2 * kChip_m;
}

TEST(ReceiverSpoofing, TheStrongerSignalTakesTheFixAlong) {
  SpoofingOptions spoofing = neighbour();
  spoofing.pull_off.north_m = 200;
  spoofing.pull_off.clock_m = 1000;  // a GLONASS chip and a half and more between all codes
  spoofing.pull_off.rate_mps = 4;
  spoofing.pull_off.acceleration_mps2 = 0.5;
  spoofing.advantage_db = 6;
  Victim taken(spoofing, plain());
  // 4 m/s, 10 s of hold and 4 s lost to the acceleration: half of the distance; true signals are echoes.
  const Observed in_motion = taken.after(39);
  EXPECT_NEAR(fix_enu(in_motion.epoch).y(), 100, 30);
  EXPECT_NEAR(in_motion.epoch.fix.velocity_enu_mps->y(), 4, 0.05);
  const Observed there = taken.after(280);
  EXPECT_LT((fix_enu(there.epoch) - Eigen::Vector3d(0, 200, 0)).norm(), 1);
  EXPECT_NEAR(there.epoch.fix.clock_bias_s.at(System::GPS) * kSpeedOfLight, 1000, 1);
  EXPECT_EQ(there.epoch.fix.status, positioning::FixStatus::Fix);

  spoofing.advantage_db = -6;
  Victim kept(spoofing, plain());
  EXPECT_LT(fix_enu(kept.after(39).epoch).norm(), 30);
  EXPECT_LT(fix_enu(kept.after(280).epoch).norm(), 1);
}

// The weaker one moves the code by the envelope of a reflection, up to 1 + d / 2 chips of distance and not at
// all beyond (docs/tracking.md): of 6 dB 36.63 m at half a chip. For a captured receiver the true signal is
// an echo.
TEST(ReceiverSpoofing, CodesStayWithinTheEnvelopeOfTwoPaths) {
  for (const double advantage_db : {-6.0206, 6.0206}) {
    SpoofingOptions spoofing = neighbour();
    spoofing.advantage_db = advantage_db;
    spoofing.carrier = SpoofingOptions::Carrier::Held;
    spoofing.pull_off.clock_m = 480;
    spoofing.pull_off.rate_mps = 4;
    Victim victim(spoofing, plain());
    for (double t = 0; t < 150; t += 5) {
      const Observed seen = victim.after(t);
      const double apart_m = std::clamp(4 * (t - 10), 0.0, 480.0);
      for (const SatelliteObservation& each : seen.epoch.satellites) {
        if (!each.measurement || each.signal->chip_rate_hz != 1.023e6 ||
            each.signal->modulation != gnss::Modulation::BPSK)
          continue;
        const double error_m = each.excess_m - (advantage_db > 0 ? apart_m : 0);
        // With a held carrier the loop lags by 4 m/s / 4 Bn, and by twice that near an echo in antiphase,
        // which halves the slope of the discriminator.
        const double lag_m = advantage_db > 0 ? 1.02 : 0.01;
        EXPECT_LE(std::abs(error_m), apart_m >= 1.25 * kChip_m + 2 ? lag_m : envelope_m(0.5) + 2 * lag_m)
            << t;
      }
    }
  }
}

TEST(ReceiverSpoofing, CaptureTakesOneToFourDecibelsAndAFrequencyWithinReach) {
  struct Row {
    double rate_mps, advantage_db;
    SpoofingOptions::Carrier carrier;
    double least, maximum;  // of the channels
  };
  using Carrier = SpoofingOptions::Carrier;
  // A carrier that jumps by 20 m/s, 105 Hz, is out of reach of an FLL of 20 ms.
  for (const Row& row : {Row{4, -3, Carrier::FollowsCode, 0, 0}, Row{4, 4, Carrier::FollowsCode, 0.95, 1},
                         Row{20, 4, Carrier::FollowsCode, 0, 0.2}, Row{8, -3, Carrier::Held, 0, 0},
                         Row{8, 1, Carrier::Held, 0.3, 0.9}, Row{8, 10, Carrier::Held, 1, 1}}) {
    int captured = 0, all = 0;
    SpoofingOptions spoofing = neighbour();
    spoofing.advantage_db = row.advantage_db;
    spoofing.carrier = row.carrier;
    spoofing.pull_off.clock_m = 900;
    spoofing.pull_off.rate_mps = row.rate_mps;
    Victim victim(spoofing, plain());
    for (const SatelliteObservation& each : victim.after(20 + 900 / row.rate_mps).epoch.satellites) {
      if (!each.measurement) continue;
      ++all;
      captured += std::abs(each.excess_m - 900) < 50;
      // One or the other: no equilibrium between.
      EXPECT_TRUE(std::abs(each.excess_m - 900) < 50 || std::abs(each.excess_m) < 50) << each.excess_m;
    }
    ASSERT_GT(all, 15);
    const double fraction = static_cast<double>(captured) / all;
    std::printf("%+.0f dB, %.0f m/s, carrier %s: %d of %d channels captured\n", row.advantage_db,
                row.rate_mps, row.carrier == Carrier::Held ? "held" : "follows", captured, all);
    EXPECT_GE(fraction, row.least);
    EXPECT_LE(fraction, row.maximum);
  }
}

// A first-order loop without aiding by its carrier lags by rate / (4 Bn).
TEST(ReceiverSpoofing, AHeldCarrierLetsTheCodeLag) {
  for (const double bn : {1.0, 0.25}) {
    ReceiverOptions options = plain();
    options.signal.dll.loop_bandwidth_hz = bn;
    SpoofingOptions spoofing = neighbour();
    spoofing.advantage_db = 20;
    spoofing.carrier = SpoofingOptions::Carrier::Held;
    spoofing.pull_off.clock_m = 1000;
    spoofing.pull_off.rate_mps = 5;
    Victim victim(spoofing, options);
    const Observed seen = victim.after(170);  // 800 m off
    int measured = 0;
    for (const SatelliteObservation& each : seen.epoch.satellites) {
      if (!each.measurement || each.signal->modulation != gnss::Modulation::BPSK) continue;
      ++measured;
      EXPECT_NEAR(each.excess_m, 800 - 5 / (4 * bn), 0.02 * 5 / (4 * bn)) << gnss::to_string(each.id);
      // Its Doppler is still the true signals'.
      const SatelliteView* view = nullptr;
      for (const SatelliteView& v : seen.arrival.views) view = v.line.id == each.id ? &v : view;
      EXPECT_NEAR(
          view->paths.paths.back().range_rate_mps * -each.measurement->carrier_frequency_hz / kSpeedOfLight,
          *each.measurement->doppler_hz, 5);
    }
    EXPECT_GT(measured, 15);
  }
}

// 5 km north and 0.1 ms later, all from one antenna: codes are far from the true ones. A tracking receiver
// stays, a searching one takes the strongest signal.
TEST(ReceiverSpoofing, AnotherPlaceIsForThoseWhoSearch) {
  SpoofingOptions spoofing = neighbour();
  spoofing.shows.position.east_m = 0;
  spoofing.shows.position.north_m = 5000;
  spoofing.shows.position.up_m = 0;
  spoofing.advantage_db = 6;
  spoofing.delay_s = 1e-4;
  Victim tracking(spoofing, plain());
  EXPECT_LT(fix_enu(tracking.after(30).epoch).norm(), 0.01);

  ReceiverOptions cold = plain();
  cold.signal.lock.warm_start = false;
  cold.signal.lock.cold_acquisition_s = 15;  // nothing is found before the spoofer begins
  Victim searching(spoofing, cold);
  const Observed seen = searching.after(30);
  EXPECT_LT((fix_enu(seen.epoch) - Eigen::Vector3d(0, 5000, 0)).norm(), 0.01);
  EXPECT_LT(seen.epoch.fix.velocity_enu_mps->norm(), 1e-3);
  const double travelled_m = Eigen::Vector3d(100, 0, 20).norm();
  EXPECT_NEAR(seen.epoch.fix.clock_bias_s.at(System::GPS), 1e-4 + travelled_m / kSpeedOfLight, 1e-10);
}

// On another continent most satellites differ. Copies that drown the true signals in noise capture tracking
// receivers as well.
TEST(ReceiverSpoofing, OverwhelmingCopiesShowAnywhere) {
  SpoofingOptions spoofing = neighbour();
  spoofing.shows.position.latitude_deg = -10;
  spoofing.shows.position.longitude_deg = 20;
  spoofing.shows.position.height_m = 600;
  spoofing.advantage_db = 40;
  ReceiverOptions options = plain();
  options.tracks = {"L1CA"};  // GLONASS' channels cause little noise to each other
  Victim victim(spoofing, options);
  const Observed seen = victim.after(30);
  const Eigen::Vector3d shown = geodesy::ecef_from_geodetic(geodesy::Geodetic::from_degrees(-10, 20, 600));
  EXPECT_LT((seen.epoch.fix.position_ecef - shown).norm(), 0.01);
  int below = 0;
  for (const SatelliteObservation& each : seen.epoch.satellites) {
    below += each.used && each.elevation_rad < 0;
    // The receiver's mask is that of its computed position.
    EXPECT_EQ(each.used, each.lock == tracking::LockState::Tracking) << gnss::to_string(each.id);
  }
  EXPECT_GT(below, 2);
}

TEST(ReceiverSpoofing, MeaconingShowsTheRepeatersPlace) {
  SpoofingOptions spoofing = neighbour();
  spoofing.kind = SpoofingOptions::Kind::Meaconing;
  spoofing.delay_s = 2e-7;
  spoofing.advantage_db = 20;
  ReceiverOptions cold = plain();
  cold.signal.lock.warm_start = false;
  cold.signal.lock.cold_acquisition_s = 15;
  cold.signal.dll.peak_check_s = std::numeric_limits<double>::infinity();
  Victim victim(spoofing, cold);
  const Observed seen = victim.after(30);
  // 100 m and 60 m of delay: the true signals are less than a chip earlier, at -20 dB.
  EXPECT_LT((fix_enu(seen.epoch) - Eigen::Vector3d(100, 0, 20)).norm(), 12);
  EXPECT_NEAR(seen.epoch.fix.clock_bias_s.at(System::GPS) * kSpeedOfLight,
              2e-7 * kSpeedOfLight + Eigen::Vector3d(100, 0, 20).norm(), 12);
}

// Copies of one code are noise to others: 1 + C / N0 (2 / 3) / Rc (interference_test.cpp).
TEST(ReceiverSpoofing, CopiesAreNoiseToOtherCodes) {
  SpoofingOptions spoofing = neighbour();
  spoofing.advantage_db = 40;
  SpoofingOptions none = spoofing;
  none.satellites = {"S39"};  // there is none
  gnss::SatelliteId copied;
  const Observed before = Victim(none, plain()).after(0);
  for (const SatelliteObservation& each : before.epoch.satellites) {
    if (each.id.system == System::GPS && each.elevation_rad > 0.3) copied = each.id;
  }
  spoofing.satellites = {gnss::to_string(copied)};
  const Observed after = Victim(spoofing, plain()).after(0);
  const double noise = 1.380649e-23 * (211 + 290 * (std::pow(10, 0.2) - 1));
  double copy_dbw = 0;
  for (const SatelliteView& view : after.arrival.views) {
    if (view.line.id == copied)
      copy_dbw = -158.5 + 3 + signal::elevation_rise_db(view.line.elevation_rad) + 40;
  }
  const double factor = 1 + std::pow(10, copy_dbw / 10) / noise * 2.0 / 3 / 1.023e6;
  EXPECT_GT(10 * std::log10(factor), 10);
  int compared = 0;
  for (const SatelliteObservation& each : after.epoch.satellites) {
    const SatelliteObservation* clear_one = find(before.epoch, each.id);
    if (each.id.system != System::GPS || each.id == copied) continue;
    ++compared;
    EXPECT_NEAR(*clear_one->cn0_dbhz - *each.cn0_dbhz, 10 * std::log10(factor), 0.01);
  }
  EXPECT_GT(compared, 3);
  EXPECT_GT(after.epoch.bands.back().carrier_hz, 1.57e9);
}

TEST(ReceiverSpoofing, OtherSignalsAndReceiversWithoutStrengthStayTrue) {
  SpoofingOptions spoofing = neighbour();
  spoofing.advantage_db = 10;
  spoofing.pull_off.north_m = 300;
  spoofing.pull_off.rate_mps = 4;
  ReceiverOptions both = plain();
  both.tracks = {"L1CA", "L5"};
  both.signal.antenna = signal::AntennaPattern("both", {{0, 0, 0}}, {{0, 0, 0}});
  Victim victim(spoofing, both);
  const Observed seen = victim.after(100);
  int fives = 0;
  for (const SatelliteObservation& each : seen.epoch.satellites) {
    for (const SignalObservation& more : each.more) {
      if (!more.measurement) continue;
      ++fives;
      EXPECT_NEAR(more.excess_m, 0, 1e-6);
    }
  }
  EXPECT_GT(fives, 1);

  ReceiverOptions ideal = plain();
  ideal.signal.enabled = false;
  Victim deaf(spoofing, ideal);
  EXPECT_LT(fix_enu(deaf.after(100).epoch).norm(), 1e-3);
}

// A receiver can detect it: its gain falls while signals do not weaken, or its clock jumps.
TEST(ReceiverSpoofing, ReceiversMayNotice) {
  ReceiverOptions options = plain();
  SpoofingOptions spoofing = neighbour();
  Victim blind(spoofing, options);
  EXPECT_EQ(blind.after(5).epoch.spoofing, SpoofingState::Unknown);

  options.spoofing_check.enabled = true;
  options.signal.front_end_bandwidth_hz = 8e6;
  SpoofingOptions none = spoofing;
  none.satellites = {"S39"};
  EXPECT_EQ(Victim(none, options).after(60).epoch.spoofing, SpoofingState::None);
  // Aligned and 16 dB over the true ones: some 20 signals of -139 dBW are more than the noise of 8 MHz.
  spoofing.advantage_db = 16;
  Victim strong(spoofing, options);
  const Observed seen = strong.after(5);
  EXPECT_GT(seen.epoch.bands[1].interference_ratio, 1);
  EXPECT_EQ(seen.epoch.spoofing, SpoofingState::Indicated);
  // As strong as the true ones, slowly: neither the gain nor a jump shows it.
  spoofing.advantage_db = 3;
  spoofing.pull_off.clock_m = 300;
  Victim quiet(spoofing, options);
  EXPECT_EQ(quiet.after(100).epoch.spoofing, SpoofingState::None);
  // A jammer weakens signals while the gain falls: no sign.
  ReceiverEpoch epoch;
  SpoofingCheck check(options.spoofing_check);
  SatelliteObservation satellite;
  satellite.signal = &gnss::signals_of(System::GPS).front();
  satellite.measurement.emplace().cn0_dbhz = 45;
  epoch.satellites = {satellite};
  epoch.bands = {{gnss::kL1_hz, 0, 0}};
  epoch.time = kTime;
  EXPECT_EQ(check.update(epoch), SpoofingState::None);
  epoch.time = kTime + 1.0;
  epoch.bands.front().interference_ratio = 9;
  epoch.satellites.front().measurement->cn0_dbhz = 36;
  EXPECT_EQ(check.update(epoch), SpoofingState::None);
  epoch.satellites.front().measurement->cn0_dbhz = 41;
  EXPECT_EQ(check.update(epoch), SpoofingState::Indicated);
  epoch.bands.front().interference_ratio = 0;
  epoch.time = kTime + 31.0;
  EXPECT_EQ(check.update(epoch), SpoofingState::Indicated);
  epoch.time = kTime + 32.0;
  EXPECT_EQ(check.update(epoch), SpoofingState::None);
}

// Found after jamming: the clock differs by 30 km.
TEST(ReceiverSpoofing, ReceiversNoticeAJumpOfTheirClock) {
  SpoofingCheckOptions options;
  options.enabled = true;
  SpoofingCheck check(options);
  ReceiverEpoch epoch;
  epoch.fix.status = positioning::FixStatus::Fix;
  epoch.fix.position_ecef = kAntenna;
  epoch.fix.position = kPosition;
  epoch.fix.velocity_enu_mps = Eigen::Vector3d(10, 0, 0);
  epoch.fix.clock_drift = 1e-6;
  for (int t = 0; t < 20; ++t) {
    epoch.time = kTime + 1.0 * t;
    epoch.fix.position_ecef = kAntenna + kEcefFromEnu * Eigen::Vector3d(10.0 * t, 0, 0);
    epoch.fix.clock_bias_s[System::GPS] = 1e-6 * t + (t >= 10 ? 1e-4 : 0);
    EXPECT_EQ(check.update(epoch), t >= 10 ? SpoofingState::Indicated : SpoofingState::None) << t;
  }
  epoch.time = kTime + 100.0;  // a long gap gives no sign
  EXPECT_EQ(check.update(epoch), SpoofingState::None);
  epoch.time = kTime + 101.0;
  epoch.fix.position_ecef += kEcefFromEnu * Eigen::Vector3d(200, 0, 0);
  epoch.fix.clock_bias_s[System::GPS] += 1e-6;
  EXPECT_EQ(check.update(epoch), SpoofingState::Indicated);
  // The gain falls, too, although no signal weakens: two signs.
  SatelliteObservation satellite;
  satellite.signal = &gnss::signals_of(System::GPS).front();
  satellite.measurement.emplace().cn0_dbhz = 45;
  epoch.satellites = {satellite};
  epoch.bands = {{gnss::kL1_hz, 0, 0}};
  EXPECT_EQ(check.update(epoch), SpoofingState::Indicated);
  epoch.time = kTime + 102.0;
  epoch.bands.front().interference_ratio = 9;
  EXPECT_EQ(check.update(epoch), SpoofingState::Multiple);
}

TEST(ReceiverSpoofing, PowerRampsUpAndTheTransmitterHasOneDirection) {
  SpoofingOptions spoofing = neighbour();
  spoofing.advantage_db = 4;
  spoofing.ramp_s = 20;
  spoofing.ramp_from_db = 30;
  Victim victim(spoofing, plain());
  const Observed half = victim.after(10), full = victim.after(25);
  const auto power_db = [](const Observed& seen) {
    return 20 * std::log10(seen.arrival.views.front().paths.paths.back().amplitude_factor);
  };
  EXPECT_NEAR(power_db(half), 4 - 15, 1e-9);
  EXPECT_NEAR(power_db(full), 4, 1e-9);
  const Eigen::Vector3d from = Eigen::Vector3d(100, 0, 20).normalized();
  for (const SatelliteView& view : full.arrival.views) {
    if (view.paths.paths.back().kind != PathKind::Transmitted) continue;
    EXPECT_LT((view.paths.paths.back().arrival - from).norm(), 1e-6);
    EXPECT_NE(view.paths.visibility, Visibility::Blocked);
  }
  // By EIRP: -60 dBm at 102 m in free space (Friis), over -158.5 dBW + 3 dB + the rise of C/A.
  spoofing.power_dbm = -60;
  Victim by_power(spoofing, plain());
  const Observed seen = by_power.after(25);
  const double loss_db =
      20 * std::log10(4 * geodesy::kPi * Eigen::Vector3d(100, 0, 20).norm() / kWavelength_m);
  for (const SatelliteView& view : seen.arrival.views) {
    if (view.line.id.system != System::GPS || view.paths.paths.back().kind != PathKind::Transmitted) continue;
    EXPECT_NEAR(20 * std::log10(view.paths.paths.back().amplitude_factor),
                -90 - loss_db - (-155.5 + signal::elevation_rise_db(view.line.elevation_rad)), 0.01);
  }
}

}  // namespace
}  // namespace canyon::receiver
