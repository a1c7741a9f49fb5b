// The receiver with direct signals shadowed by obstacles that the map lacks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <vector>

#include "canyon/receiver/receiver.hpp"
#include "tests/support/signal_scene.hpp"

namespace canyon::receiver {
namespace {

using namespace canyon::test;

/// Levels without spread: only the state matters.
ReceiverOptions shadowed(double clear_db, double shadow_db, double enter, double leave) {
  ReceiverOptions options = plain();
  options.signal.shadowing.enabled = true;
  options.signal.shadowing.numbers = {clear_db, 0, shadow_db, 0, enter, leave};
  options.signal.shadowing.skyline.fraction = 0;
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

/// High obstacles all around.
ReceiverOptions walled_in() {
  ReceiverOptions options = shadowed(0, 0, 0, 1);
  disturbance::SkylineOptions& skyline = options.signal.shadowing.skyline;
  skyline.fraction = 1;
  skyline.height_m = 100;
  return options;
}

TEST(ReceiverShadowing, ObstaclesWeakenAllPaths) {
  Receiver with(walled_in(), 3), without(plain(), 3);
  const auto lost_db = [&](PathKind kind) {
    const auto echo = [kind](const orbit::LineOfSight&) {
      Path path = mirror_path(Eigen::Vector3d(1, 0, 1).normalized(), 60, 0.5);
      path.kind = kind;
      path.edge_nu = 0;
      return std::vector<Path>{path};
    };
    return *observe_one(without, 0, echo).cn0_dbhz - *observe_one(with, 0, echo).cn0_dbhz;
  };
  EXPECT_GT(lost_db(PathKind::Diffracted), 15);
  EXPECT_GT(lost_db(PathKind::Reflected), 15);
}

// Labels follow the tracking: a satellite behind an obstacle is not in line of sight.
TEST(ReceiverShadowing, LabelsSayWhatIsTracked) {
  const auto echo = [](const orbit::LineOfSight& line) {
    Path path = mirror_path(Eigen::Vector3d::UnitZ(), 60, 0.5);  // over the obstacles
    path.point = 0.5 * path.arrival;
    return std::vector<Path>{direct_path(line), path};
  };
  using propagation::Visibility;
  Receiver open(plain(), 3), after(walled_in(), 3), alone(walled_in(), 3);
  const SatelliteObservation seen = observe_one(open, 0, echo);
  EXPECT_EQ(seen.visibility, Visibility::LOSMultipath);
  EXPECT_EQ(seen.tracked_path, PathKind::Direct);
  EXPECT_EQ(seen.obstacles_db, 0);
  const SatelliteObservation reflected = observe_one(after, 0, echo);
  EXPECT_EQ(reflected.map_visibility, Visibility::LOSMultipath);
  EXPECT_EQ(reflected.visibility, Visibility::NLOS);
  EXPECT_EQ(reflected.tracked_path, PathKind::Reflected);
  EXPECT_GT(reflected.obstacles_db, 15);
  const SatelliteObservation blocked = observe_one(alone, 0, clear);
  EXPECT_EQ(blocked.map_visibility, Visibility::LOS);
  EXPECT_EQ(blocked.tracked_path, PathKind::Direct);
  EXPECT_EQ(blocked.visibility, *blocked.cn0_dbhz < 10 ? Visibility::Blocked : Visibility::LOS);
}

// Obstacles are fixed in the world, also for a simulator's vehicles; noise and shadows are independent.
TEST(ReceiverShadowing, VehiclesWithDrawsOfTheirOwnMeetTheSameObstacles) {
  ReceiverOptions options = shadowed(0, 0, 0, 1);
  options.signal.shadowing.skyline.fraction = 0.5;
  options.signal.shadowing.skyline.height_m = 18;
  options.independent_noise = true;
  int hidden = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    options.name = "first";
    Receiver one(options, seed);
    options.name = "second";
    Receiver other(options, seed);
    const double taken_db = observe_one(one, 0, clear).obstacles_db;
    EXPECT_EQ(taken_db, observe_one(other, 0, clear).obstacles_db);
    hidden += taken_db > 10;
  }
  EXPECT_GT(hidden, 10);
  EXPECT_LT(hidden, 90);
}

TEST(ReceiverShadowing, ChangesNothingElseAtALevelOfNought) {
  // Its streams are separate: a level of 0 dB equals the receiver without shadowing.
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
  // Errors by small echoes are proportional to their relative amplitude: 10 dB are a factor of 3.2.
  const auto rms_m = [](const ReceiverOptions& options) {
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
  // The same street. For one receiver the satellite is behind buildings at three of four epochs; another one
  // has a quarter of the rate.
  const ReceiverOptions options = shadowed(-1, -9, 0.2, 0.3);
  Receiver always(options, 3), sometimes(options, 3), slow(options, 3), other(options, 4);
  int shadow = 0, differs = 0;
  for (int i = 0; i < 800; ++i) {
    const double seen = *observe_one(always, i, clear, north(2.0 * i)).cn0_dbhz - clear_cn0_dbhz();
    const auto partly = observe_one(sometimes, i, i % 4 == 0 ? clear : nothing, north(2.0 * i));
    if (i % 4 != 0) continue;
    const double rare = *observe_one(slow, i, clear, north(2.0 * i)).cn0_dbhz - clear_cn0_dbhz();
    const double otherwise = *observe_one(other, i, clear, north(2.0 * i)).cn0_dbhz - clear_cn0_dbhz();
    EXPECT_GT(seen, -9.01);
    EXPECT_LT(seen, -0.99);
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
  Receiver receiver(shadowed(0, -9, 0.25, 0.25), 5);
  int changes = 0;
  bool before = false;
  for (int i = 0; i < 3000; ++i) {
    const bool now = *observe_one(receiver, 4.0 * i, clear).cn0_dbhz - clear_cn0_dbhz() < -5;
    changes += i > 0 && now != before;
    before = now;
  }
  // 12,000 s are 273 frames, of which a quarter changes the state: 68, standard deviation sqrt(273 3 / 16)
  // = 7.
  EXPECT_NEAR(changes, 68, 22);
}

}  // namespace
}  // namespace canyon::receiver
