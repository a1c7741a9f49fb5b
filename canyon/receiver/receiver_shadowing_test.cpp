// The receiver whose direct signals are shadowed by what the map lacks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "canyon/receiver/receiver.hpp"
#include "tests/support/signal_scene.hpp"

namespace canyon::receiver {
namespace {

using namespace canyon::test;

/// Levels without spread: the state alone shows.
ReceiverOptions shadowed(double clear_db, double shadow_db, double enter, double leave) {
  ReceiverOptions options = plain();
  options.signal.shadowing.enabled = true;
  options.signal.shadowing.environment = disturbance::ShadowingEnvironment::Custom;
  options.signal.shadowing.transition_m = 0;
  options.signal.shadowing.custom = {clear_db, 0, shadow_db, 0, enter, leave};
  return options;
}

Eigen::Vector3d north(double metres) {
  return kAntenna + kEcefFromEnu * Eigen::Vector3d(0, metres, 0);
}

TEST(ReceiverShadowing, WeakensTheDirectSignalByItsLevel) {
  Receiver receiver(shadowed(-10, -10, 0, 1), 1);
  EXPECT_NEAR(*observe_one(receiver, 0, clear).cn0_dbhz, clear_cn0_dbhz() - 10, 1e-6);
}

TEST(ReceiverShadowing, LeavesEveryOtherPathAlone) {
  const auto bent = [](const orbit::LineOfSight& line) {
    Path edge = direct_path(line);
    edge.kind = PathKind::Diffracted;
    edge.edge_nu = 0;
    return std::vector<Path>{edge, mirror_path(Eigen::Vector3d(1, 0, 1).normalized(), 60, 0.5)};
  };
  Receiver with(shadowed(-10, -10, 0, 1), 1);
  Receiver without(plain(), 1);
  const SatelliteObservation a = observe_one(with, 0, bent);
  const SatelliteObservation b = observe_one(without, 0, bent);
  ASSERT_TRUE(a.cn0_dbhz);
  EXPECT_EQ(*a.cn0_dbhz, *b.cn0_dbhz);
  EXPECT_EQ(a.excess_m, b.excess_m);
}

TEST(ReceiverShadowing, ChangesNothingElseAtALevelOfNought) {
  // Its streams are its own: a level of 0 dB is the receiver without.
  ReceiverOptions on = shadowed(0, 0, 0.3, 0.3);
  on.noise.enabled = true;
  on.signal.loop_noise = true;
  on.signal.cn0_sigma_db = 1;
  ReceiverOptions off = on;
  off.signal.shadowing.enabled = false;
  Receiver with(on, 9);
  Receiver without(off, 9);
  const auto paths = [](const orbit::LineOfSight& line) {
    return std::vector<Path>{direct_path(line), mirror_path(Eigen::Vector3d(1, 0, 1).normalized(), 40, 0.4),
                             diffuse_path(Eigen::Vector3d(0, 1, 1).normalized(), 90, 0.01)};
  };
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d velocity = kEcefFromEnu * Eigen::Vector3d(0, 5, 0);
    const SatelliteObservation a = observe_one(with, i, paths, north(5.0 * i), velocity);
    const SatelliteObservation b = observe_one(without, i, paths, north(5.0 * i), velocity);
    ASSERT_TRUE(a.measurement && b.measurement);
    EXPECT_EQ(*a.cn0_dbhz, *b.cn0_dbhz);
    EXPECT_EQ(a.measurement->pseudorange_m, b.measurement->pseudorange_m);
    EXPECT_EQ(a.measurement->doppler_hz, b.measurement->doppler_hz);
    EXPECT_EQ(a.measurement->carrier_phase_cycles, b.measurement->carrier_phase_cycles);
    EXPECT_EQ(a.measurement->cn0_dbhz, b.measurement->cn0_dbhz);
  }
}

TEST(ReceiverShadowing, GivesMultipathItsWeight) {
  // Small echoes err by their amplitude over the direct one's: 10 dB are a factor of 3.2.
  const auto rms_m = [](ReceiverOptions options) {
    double square = 0;
    constexpr int kCount = 60;
    for (int i = 0; i < kCount; ++i) {
      Receiver receiver(options, 1);
      const auto echo = [i](const orbit::LineOfSight& line) {
        return std::vector<Path>{direct_path(line), mirror_path(Eigen::Vector3d(1, 0, 1).normalized(), 40,
                                                                0.05, static_cast<std::uint64_t>(i))};
      };
      square += std::pow(observe_one(receiver, 0, echo).excess_m, 2) / kCount;
    }
    return std::sqrt(square);
  };
  const double clear_m = rms_m(plain());
  EXPECT_GT(clear_m, 0.3);
  EXPECT_NEAR(rms_m(shadowed(-10, -10, 0, 1)) / clear_m, std::sqrt(10), 0.3);
}

TEST(ReceiverShadowing, LiesAlongTheWayWhetherSeenOrNot) {
  // The same street, whose satellite one receiver meets behind buildings at three epochs of four, and another
  // one at a quarter of the rate.
  const ReceiverOptions options = shadowed(-1, -9, 0.2, 0.3);
  Receiver always(options, 3), sometimes(options, 3), slow(options, 3), other(options, 4);
  int shadow = 0, differs = 0;
  for (int i = 0; i < 800; ++i) {
    const double seen = *observe_one(always, i, clear, north(2.0 * i)).cn0_dbhz - clear_cn0_dbhz();
    const auto partly = observe_one(sometimes, i, i % 4 == 0 ? clear : nothing, north(2.0 * i));
    if (i % 4 != 0) continue;
    const double rare = *observe_one(slow, i, clear, north(2.0 * i)).cn0_dbhz - clear_cn0_dbhz();
    const double otherwise = *observe_one(other, i, clear, north(2.0 * i)).cn0_dbhz - clear_cn0_dbhz();
    EXPECT_NEAR(seen, seen < -5 ? -9 : -1, 0.01);
    EXPECT_NEAR(*partly.cn0_dbhz - clear_cn0_dbhz(), seen, 1e-9) << i;
    EXPECT_NEAR(rare, seen, 1e-9) << i;
    shadow += seen < -5;
    differs += std::abs(otherwise - seen) > 1;
  }
  // 40 % in shadow: 200 epochs, frames of 4.4 m.
  EXPECT_GT(shadow, 40);
  EXPECT_LT(shadow, 120);
  EXPECT_GT(differs, 40);
}

TEST(ReceiverShadowing, EndsAtRestBecauseWhatCastsItMoves) {
  // The chain of a street at 0.1 m/s: frames of 4.4 m take 44 s, a shadow of 1 / 0.25 frames three minutes.
  const auto shadows_of = [](double speed_mps) {
    ReceiverOptions options = shadowed(0, -9, 0.25, 0.25);
    options.signal.shadowing.obstacle_speed_mps = speed_mps;
    options.signal.shadowing.obstacle_distance_m = 0;
    Receiver receiver(options, 5);
    int changes = 0;
    bool before = false;
    for (int i = 0; i < 3000; ++i) {
      const bool now = *observe_one(receiver, 4.0 * i, clear).cn0_dbhz - clear_cn0_dbhz() < -5;
      changes += i > 0 && now != before;
      before = now;
    }
    return changes;
  };
  EXPECT_EQ(shadows_of(0), 0);
  // 12,000 s are 273 frames, of which a quarter changes the state: 68, standard deviation sqrt(273 3 / 16)
  // = 7.
  EXPECT_NEAR(shadows_of(0.1), 68, 22);
}

TEST(ReceiverShadowing, MovesWithTheSatelliteAtRest) {
  // 10 m away, shadows cross the antenna at 10 m times the satellite's angular rate, of the order of 1 mm/s:
  // a second changes levels by sigma sqrt(2 * 1 mm / 1.7 m), hours change them altogether.
  ReceiverOptions options = shadowed(0, 0, 0, 1);
  options.signal.shadowing.custom.clear_sigma_db = 4;
  options.signal.shadowing.obstacle_speed_mps = 0;
  const auto levels = [&](const orbit::Sky& sky, double step_s, int count) {
    Receiver with(options, 5);
    Receiver without(plain(), 5);
    std::vector<std::vector<double>> result;
    for (int i = 0; i < count; ++i) {
      const GpsTime time = kTime + step_s * i;
      const std::vector<SatelliteView> views = open_sky(sky, time, kAntenna);
      const ReceiverEpoch a = observe(with, sky, time, views);
      const ReceiverEpoch b = observe(without, sky, time, views);
      result.emplace_back();
      for (const SatelliteObservation& each : a.satellites) {
        result.back().push_back(*each.cn0_dbhz - *find(b, each.id)->cn0_dbhz);
      }
    }
    return result;
  };
  const auto frozen = levels(six_satellites(), 600, 5);
  for (const auto& epoch : frozen) {
    for (std::size_t i = 0; i < epoch.size(); ++i) EXPECT_NEAR(epoch[i], frozen.front()[i], 1e-6);
  }
  EXPECT_GT(std::abs(frozen.front()[0] - frozen.front()[1]), 0.01);

  const auto change = [](const std::vector<std::vector<double>>& seen) {
    double square = 0;
    int n = 0;
    for (std::size_t k = 1; k < seen.size(); ++k) {
      for (std::size_t i = 0; i < seen[k].size(); ++i, ++n)
        square += std::pow(seen[k][i] - seen[k - 1][i], 2);
    }
    return std::sqrt(square / n);
  };
  const double second = change(levels(four_systems(), 1, 20));
  EXPECT_GT(second, 0.3 * 4 * std::sqrt(2 * 0.001 / 1.7));
  EXPECT_LT(second, 3 * 4 * std::sqrt(2 * 0.001 / 1.7));
  EXPECT_GT(change(levels(four_systems(), 300, 2)), 4 * second);
}

}  // namespace
}  // namespace canyon::receiver
