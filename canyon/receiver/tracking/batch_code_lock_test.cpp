#include "canyon/receiver/tracking/batch_code_lock.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <iostream>
#include <vector>

#include "canyon/base/random.hpp"
#include "canyon/receiver/tracking/correlation.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::tracking {
namespace {

/// As in receivers of the mass market: 4 MHz, a quarter chip.
BatchCodeLock lock_of(Modulation modulation, Discriminator discriminator = Discriminator::EarlyLatePower) {
  CorrelationOptions signal;
  signal.modulation = modulation;
  signal.bandwidth_hz = 4e6;
  DllOptions loop;
  loop.discriminator = discriminator;
  loop.spacing_chips = 0.25;
  loop.loop_bandwidth_hz = 0.3;
  return BatchCodeLock(shared_code_tracker(signal, loop));
}

/// 400 satellites of 1 to 12 paths with detours to 300 m, 17 lanes, the last one alone: each compared with
/// CodeTracker::lock().
void compare(const BatchCodeLock& lock, bool direct, double* worst_m, int* others) {
  RandomStream random(3, direct ? "direct" : "echoes");
  BatchCodeLock::Paths paths;
  constexpr std::size_t kLanes = 17;
  const double chip_m = lock.tracker().correlation().chip_m();
  for (int n = 0; n < 400; ++n) {
    paths.clear(kLanes);
    std::vector<std::vector<SignalPath>> alone(kLanes);
    const int count = 1 + static_cast<int>(12 * random.uniform());
    for (int p = 0; p < count; ++p) {
      const bool first = direct && p == 0;
      const double delay_m = first ? 0 : 300 * random.uniform() * random.uniform();
      const double size = first ? 1 : 0.6 * random.uniform() * random.uniform();
      const double fading_hz = first ? 0 : 0.3 * random.normal();
      const BatchCodeLock::CoherenceWeights weights = lock.average(fading_hz);
      const std::size_t at = paths.add(delay_m / chip_m);
      for (std::size_t i = 0; i < kLanes; ++i) {
        const std::complex<double> amplitude = std::polar(size, 6.3 * random.uniform());
        alone[i].push_back({delay_m, amplitude, fading_hz});
        paths.re[at + i] = static_cast<float>(amplitude.real() * weights.coherent);
        paths.im[at + i] = static_cast<float>(amplitude.imag() * weights.coherent);
        paths.incoherent[at + i] = static_cast<float>(size * size * weights.incoherent);
      }
    }
    std::vector<float> delay_m(kLanes), power(kLanes);
    lock.lock(paths, delay_m, power);
    for (std::size_t i = 0; i < kLanes; ++i) {
      const auto expected = lock.tracker().lock(alone[i]);
      ASSERT_EQ(expected.has_value(), power[i] > 0);
      if (!expected) continue;
      const double apart_m = std::abs(expected->delay_m - static_cast<double>(delay_m[i]));
      // The other of two zeros close together, or of two peaks of equal power.
      if (apart_m > 0.05) {
        ++*others;
        continue;
      }
      *worst_m = std::max(*worst_m, apart_m);
      EXPECT_NEAR(static_cast<double>(power[i]), expected->prompt_power, 3e-4 * expected->prompt_power);
    }
  }
}

// The reference is CodeTracker::lock(), which is tested against closed forms.
TEST(BatchCodeLock, StandsWhereTheLoopStands) {
  for (const Modulation modulation : {Modulation::BPSK, Modulation::BOC11}) {
    const BatchCodeLock lock = lock_of(modulation);
    for (const bool direct : {true, false}) {
      double worst_m = 0;
      int others = 0;
      compare(lock, direct, &worst_m, &others);
      std::cout << name(modulation) << (direct ? ", direct path: " : ", echoes alone: ") << worst_m
                << " m at most, " << others << " of 6800 stand elsewhere\n";
      EXPECT_LT(worst_m, 0.02);
      EXPECT_LE(others, 6800 / 1000);
    }
  }
}

// A single path: no error, and R(0)^2 of its power.
TEST(BatchCodeLock, StandsOnASinglePath) {
  const BatchCodeLock lock = lock_of(Modulation::BPSK);
  const double r0 = lock.tracker().correlation().value(0);
  BatchCodeLock::Paths paths;
  paths.clear(8);
  const std::size_t at = paths.add(0.25);
  for (std::size_t i = 0; i < 8; ++i) paths.re[at + i] = i < 4 ? 0.5F : 0;
  std::vector<float> delay_m(8), power(8);
  lock.lock(paths, delay_m, power);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(static_cast<double>(delay_m[i]), 0.25 * lock.tracker().correlation().chip_m(), 1e-3);
    EXPECT_NEAR(static_cast<double>(power[i]), 0.25 * r0 * r0, 1e-6);
    EXPECT_EQ(power[4 + i], 0);
  }
}

// Other discriminators are left to CodeTracker.
TEST(BatchCodeLock, LeavesOtherDiscriminatorsToTheTracker) {
  const BatchCodeLock lock = lock_of(Modulation::BPSK, Discriminator::DotProduct);
  double worst_m = 0;
  int others = 0;
  compare(lock, true, &worst_m, &others);
  EXPECT_LT(worst_m, 1e-3);
  EXPECT_EQ(others, 0);
}

}  // namespace
}  // namespace canyon::tracking
