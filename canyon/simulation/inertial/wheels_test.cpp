#include "canyon/simulation/inertial/sensors.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace canyon::inertial {
namespace {

WheelOptions perfect() {
  WheelOptions options;
  options.scale = options.slip = 0;
  options.tick_m = 0;
  return options;
}

TEST(Wheels, PerfectOnesStateTheWay) {
  Wheels wheels(perfect(), 1);
  const WheelSample sample = wheels.measure({1.2, -0.8}, 0.1);
  EXPECT_NEAR(sample.speed_mps[0], 12, 1e-12);
  EXPECT_NEAR(sample.speed_mps[1], -8, 1e-12);
  EXPECT_FALSE(sample.ticks);
}

// Ticks lose nothing: the remainder of an interval is counted in a later one.
TEST(Wheels, CountTicks) {
  WheelOptions options = perfect();
  options.tick_m = 0.5;
  Wheels wheels(options, 1);
  EXPECT_EQ(wheels.measure({0.4, -0.1}, 0.1).ticks->at(0), 0);
  const WheelSample second = wheels.measure({0.4, 0.2}, 0.1);
  EXPECT_EQ(second.ticks->at(0), 1);
  EXPECT_EQ(second.ticks->at(1), 0);
  EXPECT_NEAR(second.speed_mps[0], 5, 1e-12);
  EXPECT_NEAR(second.speed_mps[1], 5, 1e-12);  // back from the tick that -0.1 m crossed
}

TEST(Wheels, WithoutDirectionCountUp) {
  WheelOptions options = perfect();
  options.tick_m = 0.1;
  options.direction = false;
  Wheels wheels(options, 1);
  (void)wheels.measure({-1.05, -1.05}, 0.1);
  EXPECT_EQ(wheels.measure({1.05, -1.05}, 0.1).ticks->at(0), 21);
  EXPECT_NEAR(wheels.measure({-1, -1}, 0.1).speed_mps[1], 10, 1e-9);
}

// Scale: one per run and wheel. Slip: with its deviation, decorrelated over its time constant.
TEST(Wheels, HaveTheErrorsOfTheirNumbers) {
  double scale2 = 0;
  WheelOptions options = perfect();
  options.scale = 0.01;
  for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
    Wheels wheels(options, seed);
    const double first = wheels.measure({1, 1}, 0.1).speed_mps[0] / 10 - 1;
    scale2 += first * first;
    EXPECT_NEAR(wheels.measure({1, 1}, 0.1).speed_mps[0] / 10 - 1, first, 1e-12);
  }
  EXPECT_NEAR(std::sqrt(scale2 / 2000), 0.01, 0.0006);

  options = perfect();
  options.slip = 0.02;
  options.slip_time_s = 2;
  Wheels wheels(options, 3);
  double square = 0, product = 0, before = 0;
  constexpr int kCount = 200'000;
  for (int k = 0; k < kCount; ++k) {
    const double slip = wheels.measure({1, 1}, 0.1).speed_mps[1] / 10 - 1;
    square += slip * slip;
    product += slip * before;
    before = slip;
  }
  EXPECT_NEAR(std::sqrt(square / kCount), 0.02, 0.001);
  EXPECT_NEAR(product / square, std::exp(-0.1 / 2), 0.01);
}

}  // namespace
}  // namespace canyon::inertial
