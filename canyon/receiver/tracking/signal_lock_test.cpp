#include "canyon/receiver/tracking/signal_lock.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/receiver/tracking/noise.hpp"

namespace canyon::tracking {
namespace {

using geodesy::GpsTime;

const GpsTime kStart = GpsTime::from_week(2100, 1000);

SignalLockOptions options() {
  SignalLockOptions options;
  options.acquisition_threshold_dbhz = 30;
  options.tracking_threshold_dbhz = 20;
  options.cold_acquisition_s = 10;
  options.reacquisition_s = 2;
  options.hold_s = 0.5;
  options.memory_s = 60;
  return options;
}

TEST(SignalLock, ColdAcquisition) {
  SignalLock lock(options());
  EXPECT_EQ(lock.update(kStart, 45), LockState::Searching);
  EXPECT_EQ(lock.update(kStart + 9.999, 45), LockState::Searching);
  EXPECT_FALSE(lock.tracking_since());
  EXPECT_EQ(lock.update(kStart + 10.0, 45), LockState::Tracking);
  EXPECT_EQ(lock.tracking_since(), kStart + 10.0);
}

TEST(SignalLock, AcquisitionStartsAgainAfterABreak) {
  SignalLock lock(options());
  lock.update(kStart, 45);
  lock.update(kStart + 9.0, 45);
  lock.update(kStart + 9.1, 29.9);  // strong enough for tracking, not for acquisition
  EXPECT_EQ(lock.update(kStart + 19.0, 45), LockState::Searching);
  EXPECT_EQ(lock.update(kStart + 19.2, 45), LockState::Tracking);
  EXPECT_EQ(lock.tracking_since(), kStart + 19.1);
}

TEST(SignalLock, HysteresisBetweenTheThresholds) {
  SignalLock lock(options());
  lock.update(kStart, 25);
  EXPECT_EQ(lock.update(kStart + 1000.0, 25), LockState::Searching);
  EXPECT_EQ(lock.update(kStart + 1010.0, 30), LockState::Tracking);
  EXPECT_EQ(lock.update(kStart + 2000.0, 20), LockState::Tracking);
  EXPECT_EQ(lock.update(kStart + 2000.1, 19.99), LockState::Holding);
}

TEST(SignalLock, HoldsThroughAShortBreak) {
  SignalLock lock(options());
  lock.update(kStart, 45);
  lock.update(kStart + 10.0, 45);
  EXPECT_EQ(lock.update(kStart + 10.499, std::nullopt), LockState::Holding);
  EXPECT_FALSE(lock.tracking_since());
  EXPECT_EQ(lock.update(kStart + 10.6, 21), LockState::Tracking);
  EXPECT_EQ(lock.tracking_since(), kStart + 10.499);
}

TEST(SignalLock, ReacquiresWithinItsMemory) {
  for (const double gap : {0.6, 5.0, 60.5}) {
    SignalLock lock(options());
    lock.update(kStart, 45);
    lock.update(kStart + 10.0, 45);
    EXPECT_EQ(lock.update(kStart + (10.0 + gap), std::nullopt), LockState::Searching);
    lock.update(kStart + (100.0 + gap), 45);
    EXPECT_EQ(lock.tracking_since(), kStart + (12.0 + gap)) << gap;
  }
  // Lost at 10.5 s, forgotten 60 s later.
  SignalLock lock(options());
  lock.update(kStart, 45);
  lock.update(kStart + 10.0, 45);
  lock.update(kStart + 70.6, std::nullopt);
  lock.update(kStart + 100.0, 45);
  EXPECT_EQ(lock.tracking_since(), kStart + 80.6);
}

TEST(SignalLock, WarmStartTracksAtOnce) {
  SignalLockOptions warm = options();
  warm.warm_start = true;
  SignalLock strong(warm);
  EXPECT_EQ(strong.update(kStart, 30), LockState::Tracking);
  EXPECT_EQ(strong.tracking_since(), kStart);
  SignalLock weak(warm);
  EXPECT_EQ(weak.update(kStart, 25), LockState::Searching);
  weak.update(kStart + 1.0, 25);
  EXPECT_EQ(weak.update(kStart + 3.0, 35), LockState::Tracking);
}

TEST(SignalLock, NoTimesMeansAtOnce) {
  SignalLockOptions none = options();
  none.cold_acquisition_s = none.reacquisition_s = none.hold_s = 0;
  SignalLock lock(none);
  EXPECT_EQ(lock.update(kStart, 30), LockState::Tracking);
  EXPECT_EQ(lock.update(kStart + 0.1, 10), LockState::Searching);
  EXPECT_EQ(lock.update(kStart + 0.2, 30), LockState::Tracking);
  EXPECT_EQ(lock.tracking_since(), kStart + 0.1);
}

// Periods of random length and strength, in one step or in random pieces: the same states at their ends, and
// the same instants, to the nanosecond.
TEST(SignalLock, StepsDoNotMatter) {
  RandomStream random(21, "lock");
  int changes = 0;
  for (int run = 0; run < 200; ++run) {
    SignalLockOptions some = options();
    some.warm_start = run % 2 == 0;
    some.hold_s = 3 * random.uniform();
    SignalLock whole(some);
    SignalLock pieces(some);
    GpsTime time = kStart;
    const double first = 50 * random.uniform();
    whole.update(time, first);
    pieces.update(time, first);
    for (int stretch = 0; stretch < 60; ++stretch) {
      const GpsTime end = time + 20 * std::pow(random.uniform(), 3);
      std::optional<double> cn0;
      if (random.uniform() < 0.8) cn0 = 12 + 30 * random.uniform();
      while (time < end && random.uniform() < 0.95) {
        time = std::min(end, time + (end - time) * random.uniform());
        pieces.update(time, cn0);
      }
      time = end;
      const LockState before = whole.state();
      EXPECT_EQ(whole.update(time, cn0), pieces.update(time, cn0));
      EXPECT_EQ(whole.tracking_since(), pieces.tracking_since());
      changes += before != whole.state() ? 1 : 0;
    }
  }
  EXPECT_GT(changes, 1'000);
}

TEST(SignalLock, RefusesBadInput) {
  SignalLock lock(options());
  lock.update(kStart, 45);
  EXPECT_THROW(lock.update(kStart - 1.0, 45), InputError);
  EXPECT_THROW(lock.update(kStart + 1.0, std::nan("")), InputError);
  const auto refused = [](auto change) {
    SignalLockOptions bad = options();
    change(bad);
    EXPECT_THROW(SignalLock{bad}, InputError);
  };
  refused([](SignalLockOptions& o) { o.tracking_threshold_dbhz = 31; });
  refused([](SignalLockOptions& o) { o.tracking_threshold_dbhz = std::nan(""); });
  refused([](SignalLockOptions& o) { o.acquisition_threshold_dbhz = std::nan(""); });
  refused([](SignalLockOptions& o) { o.hold_s = -1; });
  refused([](SignalLockOptions& o) { o.memory_s = std::nan(""); });
  refused([](SignalLockOptions& o) { o.cold_acquisition_s = 1e9; });
  refused([](SignalLockOptions& o) { o.reacquisition_s = -0.1; });
}

TEST(SignalLock, NamesItsStates) {
  EXPECT_EQ(name(LockState::Searching), "searching");
  EXPECT_EQ(name(LockState::Tracking), "tracking");
  EXPECT_EQ(name(LockState::Holding), "holding");
}

}  // namespace
}  // namespace canyon::tracking
