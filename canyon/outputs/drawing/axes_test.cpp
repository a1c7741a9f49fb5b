#include <gtest/gtest.h>

#include <gmock/gmock.h>
#include <cmath>
#include <limits>

#include "canyon/outputs/drawing/plot.hpp"

namespace canyon::drawing {
namespace {

using ::testing::ElementsAre;

TEST(Axes, NiceNumbers) {
  EXPECT_DOUBLE_EQ(nice_ceil(1), 1);
  EXPECT_DOUBLE_EQ(nice_ceil(1.01), 2);
  EXPECT_DOUBLE_EQ(nice_ceil(2.1), 5);
  EXPECT_DOUBLE_EQ(nice_ceil(51), 100);
  EXPECT_DOUBLE_EQ(nice_ceil(0.003), 0.005);
  EXPECT_DOUBLE_EQ(nice_floor(1), 1);
  EXPECT_DOUBLE_EQ(nice_floor(1.99), 1);
  EXPECT_DOUBLE_EQ(nice_floor(4.9), 2);
  EXPECT_DOUBLE_EQ(nice_floor(0.0071), 0.005);
}

TEST(Axes, LinearTicks) {
  EXPECT_THAT(linear_ticks(0, 1, 5), ElementsAre(0, 0.2, 0.4, ::testing::DoubleEq(0.6), 0.8, 1));
  EXPECT_THAT(linear_ticks(-130, 60, 4), ElementsAre(-100, -50, 0, 50));
}

TEST(Axes, TimeSteps) {
  EXPECT_EQ(nice_time_step(0.9), 1);
  EXPECT_EQ(nice_time_step(11), 15);
  EXPECT_EQ(nice_time_step(54), 60);
  EXPECT_EQ(nice_time_step(100'000), 172'800);
}

TEST(Axes, TickLabels) {
  EXPECT_EQ(tick_label(0), "0");
  EXPECT_EQ(tick_label(0.5), "0.5");
  EXPECT_EQ(tick_label(2000), "2000");
  EXPECT_EQ(tick_label(1e-5), "1e-05");
}

TEST(Axes, NarrowValuesGetALinearScaleFromZero) {
  const Scale scale = make_scale({1.2, 1.5, 2.077}, 0);
  EXPECT_FALSE(scale.logarithmic);
  EXPECT_EQ(scale.low, 0);
  EXPECT_DOUBLE_EQ(scale.high, 2.5);
  EXPECT_DOUBLE_EQ(scale.at(1.25), 0.5);
  EXPECT_EQ(scale.at(-1), 0);
  EXPECT_EQ(scale.at(99), 1);
  EXPECT_EQ(scale.at(std::numeric_limits<double>::quiet_NaN()), 0);
}

TEST(Axes, WideValuesGetALogarithmicScale) {
  const Scale scale = make_scale({0.2, 1, 5, 63}, 0);
  EXPECT_TRUE(scale.logarithmic);
  EXPECT_LE(scale.low, 0.25);
  EXPECT_DOUBLE_EQ(scale.high, 100);
  EXPECT_NEAR(scale.at(std::sqrt(scale.low * scale.high)), 0.5, 1e-12);
  EXPECT_EQ(scale.at(0), 0);
  EXPECT_FALSE(scale.ticks.empty());
}

TEST(Axes, DecadesHoldTheirEnds) {
  const Scale scale = decade_scale(0.3, 40);
  EXPECT_TRUE(scale.logarithmic);
  EXPECT_DOUBLE_EQ(scale.low, 0.1);
  EXPECT_DOUBLE_EQ(scale.high, 100);
  EXPECT_EQ(scale.ticks.size(), 4U);
  EXPECT_DOUBLE_EQ(decade_scale(0.1, 100).low, 0.1) << "ends that are decades stay";
  EXPECT_DOUBLE_EQ(decade_scale(0.1, 100).high, 100);
}

TEST(Axes, NoValues) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& values :
       {std::vector<double>{}, std::vector<double>{nan, nan}, std::vector<double>{0, 0}}) {
    const Scale scale = make_scale(values, 0.02);
    EXPECT_EQ(scale.low, 0);
    EXPECT_EQ(scale.high, 1);
    EXPECT_GE(scale.ticks.size(), 2U);
  }
}

}  // namespace
}  // namespace canyon::drawing
