#include "canyon/receiver/tracking/noise.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "canyon/base/input_error.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::tracking {
namespace {

TEST(ReceiverClock, WithoutWalkTheBiasGrowsWithTheDrift) {
  ClockOptions options;
  options.bias_s = 5e-4;
  options.drift = -2e-7;
  ReceiverClock clock(options, RandomStream(1, "clock"));
  EXPECT_EQ(clock.bias_s(), 5e-4);
  for (int i = 0; i < 1000; ++i) clock.advance(0.1);
  EXPECT_NEAR(clock.bias_s(), 5e-4 - 2e-7 * 100, 1e-15);
  EXPECT_EQ(clock.drift(), -2e-7);
}

// The pseudoranges' clock is around the bias at each epoch, while Dopplers have the drift.
TEST(ReceiverClock, TagsAreSetAnewAtEachEpoch) {
  ClockOptions options;
  options.bias_s = 5e-4;
  options.drift = -1e-7;
  options.tag_sigma_s = 3e-8;
  ReceiverClock clock(options, RandomStream(3, "clock"));
  constexpr int kEpochs = 10'000;
  double mean = 0, square = 0;
  for (int i = 0; i < kEpochs; ++i) {
    clock.advance(1);
    EXPECT_EQ(clock.drift(), -1e-7);
    const double off = clock.bias_s() - 5e-4;
    mean += off / kEpochs;
    square += off * off / kEpochs;
  }
  EXPECT_NEAR(mean, 0, 5 * 3e-8 / std::sqrt(kEpochs));
  EXPECT_NEAR(square, 9e-16, 5 * 9e-16 * std::sqrt(2.0 / kEpochs));
}

/// Random walk of the drift over T = 10 s in the given number of steps, over many clocks.
class ClockSteps : public testing::TestWithParam<int> {};

TEST_P(ClockSteps, CovarianceIsThatOfTheContinuousModel) {
  constexpr double kSpan_s = 10;
  constexpr double kWalk = 1e-8;
  constexpr int kClocks = 20'000;
  ClockOptions options;
  options.drift_walk = kWalk;
  double bb = 0, bd = 0, dd = 0;
  for (int i = 0; i < kClocks; ++i) {
    ReceiverClock clock(options, RandomStream(2, "clock " + std::to_string(i)));
    for (int k = 0; k < GetParam(); ++k) clock.advance(kSpan_s / GetParam());
    bb += clock.bias_s() * clock.bias_s() / kClocks;
    bd += clock.bias_s() * clock.drift() / kClocks;
    dd += clock.drift() * clock.drift() / kClocks;
  }
  const double q = kWalk * kWalk;
  const double b2 = q * std::pow(kSpan_s, 3) / 3;
  const double c = q * std::pow(kSpan_s, 2) / 2;
  const double d2 = q * kSpan_s;
  // Five deviations: var(s_ij) = (s_ii s_jj + s_ij^2) / n for normal samples.
  EXPECT_NEAR(bb, b2, 5 * b2 * std::sqrt(2.0 / kClocks));
  EXPECT_NEAR(dd, d2, 5 * d2 * std::sqrt(2.0 / kClocks));
  EXPECT_NEAR(bd, c, 5 * std::sqrt((b2 * d2 + c * c) / kClocks));
}
INSTANTIATE_TEST_SUITE_P(Steps, ClockSteps, testing::Values(1, 10, 100));

TEST(ReceiverClock, RefusesBadOptionsAndSteps) {
  const auto message = [](double bias, double drift, double walk) {
    ClockOptions options;
    options.bias_s = bias;
    options.drift = drift;
    options.drift_walk = walk;
    return test::refusal([&] { options.validate(); });
  };
  EXPECT_THAT(message(0.2, 0, 0), testing::HasSubstr("bias_s"));
  EXPECT_THAT(message(std::nan(""), 0, 0), testing::HasSubstr("bias_s"));
  EXPECT_THAT(message(0, -1e-3, 0), testing::HasSubstr("drift of"));
  EXPECT_THAT(message(0, 0, -1), testing::HasSubstr("drift_walk"));
  EXPECT_EQ(message(0.1, 1e-4, 1e-4), "");
  ReceiverClock clock(ClockOptions{}, RandomStream(1, "x"));
  EXPECT_THROW(clock.advance(-0.1), InputError);
}

}  // namespace
}  // namespace canyon::tracking
