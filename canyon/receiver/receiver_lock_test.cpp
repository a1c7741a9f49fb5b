// Times and signals at which a receiver with signal strength starts tracking.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "canyon/receiver/receiver.hpp"
#include "tests/support/signal_scene.hpp"

namespace canyon::receiver {
namespace {

using namespace canyon::test;
using geodesy::kPi;
using raytrace::Containment;

/// Lock states every `step_s` for 12 s; the wall exists from 5 s until before 8 s.
std::vector<tracking::LockState> states_near_a_wall(double step_s) {
  ReceiverOptions options = plain();
  options.signal.lock.hold_s = 0.6;
  options.signal.lock.reacquisition_s = 1.5;
  Receiver receiver(options, 1);
  std::vector<tracking::LockState> states;
  for (int i = 0; i * step_s <= 12; ++i) {
    const bool blocked = i * step_s > 4.99 && i * step_s < 7.99;
    const SatelliteObservation seen = observe_one(receiver, i * step_s, blocked ? nothing : clear);
    EXPECT_EQ(seen.measurement.has_value(), seen.lock == tracking::LockState::Tracking);
    EXPECT_EQ(seen.cn0_dbhz.has_value(), !blocked);
    states.push_back(seen.lock);
  }
  return states;
}

// An update gives the state since the previous one. The signal disappears at 4.9 s and returns at 7.9 s.
TEST(ReceiverLock, LossAndReacquisitionTakeTheirTimes) {
  const std::vector<tracking::LockState> states = states_near_a_wall(0.1);
  for (int i = 0; i <= 120; ++i) {
    const tracking::LockState expected = i < 50   ? tracking::LockState::Tracking
                                         : i < 55 ? tracking::LockState::Holding
                                         : i < 94 ? tracking::LockState::Searching
                                                  : tracking::LockState::Tracking;
    EXPECT_EQ(states[static_cast<std::size_t>(i)], expected) << i;
  }
  // It holds from 4 s to 4.6 s, and is found at 7 s + 1.5 s.
  const std::vector<tracking::LockState> coarse = states_near_a_wall(1);
  for (int i = 0; i <= 12; ++i) {
    EXPECT_EQ(coarse[static_cast<std::size_t>(i)],
              i < 5 || i >= 9 ? tracking::LockState::Tracking : tracking::LockState::Searching)
        << i;
  }
}

TEST(ReceiverLock, ColdReceiversSearchAndRisingSatellitesAreFound) {
  ReceiverOptions options = plain();
  options.signal.lock.warm_start = false;
  options.signal.lock.cold_acquisition_s = 20;
  Receiver cold(options, 1);
  for (int t = 0; t <= 25; ++t) {
    EXPECT_EQ(observe_one(cold, t, clear).lock,
              t < 20 ? tracking::LockState::Searching : tracking::LockState::Tracking)
        << t;
  }
  // Rises at 100 s (seen since 99 s), in a receiver running since 0 s.
  options.signal.lock.warm_start = true;
  options.signal.lock.reacquisition_s = 3;
  Receiver warm(options, 1);
  for (int t = 0; t < 120; ++t) {
    std::vector<SatelliteView> views;
    if (t >= 100) views = open_sky(one_satellite(), kTime + 1.0 * t, kAntenna);
    const ReceiverEpoch epoch = observe(warm, one_satellite(), kTime + 1.0 * t, views);
    if (t >= 100) {
      EXPECT_EQ(epoch.satellites.front().lock,
                t < 102 ? tracking::LockState::Searching : tracking::LockState::Tracking)
          << t;
      EXPECT_EQ(epoch.visible, t < 102 ? 0 : 1);
      EXPECT_EQ(epoch.blocked, t < 102 ? 1 : 0);
    }
  }
  // A satellite that sets is lost, even without updates in between.
  const ReceiverEpoch gone = observe(warm, one_satellite(), kTime + 130.0, {});
  EXPECT_TRUE(gone.satellites.empty());
  EXPECT_EQ(observe_one(warm, 131, clear).lock, tracking::LockState::Searching);
}

TEST(ReceiverLock, InsideABuildingTheLockIsLost) {
  Receiver receiver(plain(), 1);
  EXPECT_EQ(observe_one(receiver, 0, clear).lock, tracking::LockState::Tracking);
  const std::vector<SatelliteView> views = open_sky(one_satellite(), kTime + 10.0, kAntenna);
  const ReceiverEpoch inside = observe_views(receiver, kTime + 10.0, kAntenna, kAtRest, views, kEcefFromEnu,
                                             Containment::InsideBuilding, one_satellite());
  EXPECT_EQ(inside.fix.status, positioning::FixStatus::NoSignal);
  EXPECT_EQ(inside.satellites.front().lock, tracking::LockState::Searching);
  EXPECT_EQ(inside.satellites.front().visibility, Visibility::Blocked);
  EXPECT_FALSE(inside.satellites.front().cn0_dbhz || inside.satellites.front().measurement);
  EXPECT_EQ(inside.satellites.front().excess_m, 0);
  EXPECT_EQ(inside.blocked, 1);
}

// No signal at the very instant of the previous epoch: the lock stays, without a measurement.
TEST(ReceiverLock, SameInstantWithoutSignalIsNotMeasured) {
  Receiver receiver(plain(), 1);
  EXPECT_EQ(observe_one(receiver, 0, clear).lock, tracking::LockState::Tracking);
  const SatelliteObservation seen = observe_one(receiver, 0, nothing);
  EXPECT_NE(seen.lock, tracking::LockState::Tracking);
  EXPECT_FALSE(seen.measurement);
  EXPECT_EQ(observe_one(receiver, 0, clear).lock, tracking::LockState::Tracking);
}

// An echo 1.37 chips late: a loop locked on it stays there when the direct path returns. It moves to the
// direct path if the antenna was moved elsewhere or the signal was lost.
TEST(ReceiverLock, TheLoopRemembersItsDelay) {
  const auto echo = [](const orbit::LineOfSight&) -> std::vector<Path> {
    return {mirror_path({0, -1, 0}, 400, 0.5)};
  };
  const auto both = [](const orbit::LineOfSight& line) -> std::vector<Path> {
    return {direct_path(line), mirror_path({0, -1, 0}, 400, 0.5)};
  };
  // Without the check for earlier paths, which would find the direct one a second after its return.
  ReceiverOptions trusting = plain();
  trusting.signal.dll.peak_check_s = std::numeric_limits<double>::infinity();
  Receiver staying(trusting, 1);
  EXPECT_NEAR(observe_one(staying, 0, echo).excess_m, 400, 1e-6);
  const SatelliteObservation kept = observe_one(staying, 1, both);
  EXPECT_NEAR(kept.excess_m, 400, 1e-6);
  EXPECT_NEAR(*kept.cn0_dbhz, clear_cn0_dbhz() - 6, 0.05);
  // The satellite is in the north: 500 m in that direction shorten the range by 383 m.
  const Eigen::Vector3d far_away = kFrame.ecef_from_local({0, 500, 0});
  EXPECT_NEAR(observe_one(staying, 2, both, far_away).excess_m, 0, 1e-6);

  Receiver driven(trusting, 1);
  EXPECT_NEAR(observe_one(driven, 0, echo).excess_m, 400, 1e-6);
  const Eigen::Vector3d velocity = kEcefFromEnu * Eigen::Vector3d(0, 250, 0);
  EXPECT_NEAR(observe_one(driven, 2, echo, kAntenna, velocity).excess_m, 400, 1e-6);
  // During its motion the direct signal is briefly within reach of the echo's replica.
  EXPECT_NEAR(observe_one(driven, 4, both, far_away, velocity).excess_m, 400, 0.01);

  Receiver looking(plain(), 1);
  EXPECT_NEAR(observe_one(looking, 0, echo).excess_m, 400, 1e-6);
  EXPECT_NEAR(observe_one(looking, 0.5, both).excess_m, 400, 1e-6);
  EXPECT_NEAR(observe_one(looking, 5, both).excess_m, 0, 1e-3);

  Receiver losing(plain(), 1);
  EXPECT_NEAR(observe_one(losing, 0, echo).excess_m, 400, 1e-6);
  EXPECT_EQ(observe_one(losing, 5, nothing).lock, tracking::LockState::Searching);
  EXPECT_EQ(observe_one(losing, 6, both).lock, tracking::LockState::Tracking);
  EXPECT_NEAR(observe_one(losing, 7, both).excess_m, 0, 1e-6);
}

// A signal too weak for tracking counts as none: the arrival has its paths, and the satellite is blocked.
TEST(ReceiverLock, EchoesTooWeakToTrackAreBlocked) {
  ReceiverOptions options = plain();
  const auto echo_of = [](double cn0_dbhz) {
    return [=](const orbit::LineOfSight&) -> std::vector<Path> {
      return {mirror_path({0, -1, 0}, 60, std::pow(10, (cn0_dbhz - clear_cn0_dbhz()) / 20))};
    };
  };
  const auto seen = [&](double cn0_dbhz) {
    Receiver receiver(options, 1);
    return observe_one(receiver, 0, echo_of(cn0_dbhz));
  };
  const tracking::SignalLockOptions& lock = options.signal.lock;
  const SatelliteObservation weak = seen(lock.tracking_threshold_dbhz - 0.1);
  EXPECT_EQ(weak.visibility, Visibility::Blocked);
  EXPECT_NEAR(*weak.cn0_dbhz, lock.tracking_threshold_dbhz - 0.1, 0.02);
  EXPECT_EQ(weak.excess_m, 0);
  // It could be tracked, although a searching channel does not find it.
  const SatelliteObservation kept = seen(lock.tracking_threshold_dbhz + 0.1);
  EXPECT_EQ(kept.visibility, Visibility::NLOS);
  EXPECT_FALSE(kept.measurement);
  EXPECT_EQ(seen(lock.acquisition_threshold_dbhz + 0.1).visibility, Visibility::NLOS);
  // A direct path that leaves and shadows weaken too much counts as none, except in the map.
  Receiver shaded(options, 1);
  const SatelliteObservation direct = observe_one(shaded, 0, [](const orbit::LineOfSight& line) {
    Path path = direct_path(line);
    path.amplitude_factor = 1e-3;
    return std::vector{path};
  });
  EXPECT_EQ(direct.visibility, Visibility::Blocked);
  EXPECT_EQ(direct.map_visibility, Visibility::LOS);
  EXPECT_NEAR(direct.obstacles_db, 60, 1e-9);
  EXPECT_FALSE(direct.measurement);
  // A receiver without strength tracks every arriving signal.
  options = plain();
  options.signal.enabled = false;
  EXPECT_EQ(seen(-20).visibility, Visibility::NLOS);
}

}  // namespace
}  // namespace canyon::receiver
