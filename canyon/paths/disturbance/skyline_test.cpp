#include "canyon/paths/disturbance/skyline.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/statistics.hpp"
#include "tests/support/spoiled_options.hpp"

namespace canyon::disturbance {
namespace {

using geodesy::radians;

constexpr double kHeight_m = 12, kFraction = 0.4;

ShadowingOptions some() {
  ShadowingOptions options;
  options.enabled = true;
  options.skyline.fraction = kFraction;
  options.skyline.height_m = kHeight_m;
  return options;
}

/// Tangents of the tops' elevations in all azimuths at many positions; 0 without an obstacle.
std::vector<double> slopes(Skyline& skyline, double height_m) {
  std::vector<double> result;
  for (int i = 0; i < 3000; ++i) {
    skyline.go_to({37.0 * i, -11.0 * i}, height_m);
    for (int k = 0; k < 4; ++k) result.push_back(std::tan(skyline.top_rad(radians(7 + 90 * k))));
  }
  return result;
}
double fraction_above(const std::vector<double>& values, double limit) {
  double count = 0;
  for (const double value : values) count += value > limit;
  return count / static_cast<double>(values.size());
}
/// For obstacles whose heights have a gamma distribution of shape 2, p (1 + x) e^-x, over their distances.
double expected_above(double slope, double height_m) {
  double sum = 0;
  constexpr int kSteps = 200;
  for (int i = 0; i < kSteps; ++i) {
    const double distance_m = SkylineOptions::kDistance_m *
                              std::exp(SkylineOptions::kDistanceSigma * normal_quantile((i + 0.5) / kSteps));
    const double x = 2 * (slope * distance_m + height_m - SkylineOptions::kBase_m) / kHeight_m;
    sum += (1 + x) * std::exp(-x);
  }
  return kFraction * sum / kSteps;
}

TEST(Skyline, HasTheDistributionOfHeightsThatItIsGiven) {
  Skyline skyline(some(), 1);
  const std::vector<double> at_roof = slopes(skyline, SkylineOptions::kBase_m);
  for (const double slope : {0.0, 0.4, 1.0, 2.0}) {
    EXPECT_NEAR(fraction_above(at_roof, slope), expected_above(slope, 2), 0.02) << slope;
  }
}

TEST(Skyline, SinksAsTheAntennaRises) {
  Skyline skyline(some(), 2);
  for (const double height_m : {10.0, 20.0}) {
    const std::vector<double> above = slopes(skyline, height_m);
    for (const double slope : {0.0, 0.5}) {
      EXPECT_NEAR(fraction_above(above, slope), expected_above(slope, height_m), 0.02) << height_m;
    }
  }
  EXPECT_EQ(fraction_above(slopes(skyline, 120), 0), 0);
}

TEST(Skyline, IsFixedInTheWorld) {
  Skyline one(some(), 3), other(some(), 3), stranger(some(), 4);
  int same = 0;
  for (int i = 0; i < 200; ++i) {
    other.go_to({3.0 * i, 900}, 2);  // elsewhere, on another route
    one.go_to({5.0 * i, 40}, 2);
    other.go_to({5.0 * i, 40}, 2);
    stranger.go_to({5.0 * i, 40}, 2);
    EXPECT_EQ(one.top_rad(1), other.top_rad(1));
    same += one.top_rad(1) == stranger.top_rad(1);
  }
  EXPECT_LT(same, 150);  // both without an obstacle
}

/// Fraction of pairs of which both or neither has an obstacle.
template <typename Second>
double alike(Skyline& skyline, const Second& second) {
  int same = 0;
  constexpr int kPairs = 4000;
  for (int i = 0; i < kPairs; ++i) {
    const Eigen::Vector2d point(61.0 * i, 17.0 * i);
    skyline.go_to(point, 2);
    const bool before = skyline.top_rad(0.5) > 0;
    same += before == (second(point) > 0);
  }
  return same / double{kPairs};
}

TEST(Skyline, IsAlikeNearby) {
  Skyline skyline(some(), 5);
  const double unlike = kFraction * kFraction + (1 - kFraction) * (1 - kFraction);
  const auto moved = [&](double east_m) {
    return alike(skyline, [&, east_m](const Eigen::Vector2d& point) {
      skyline.go_to(point + Eigen::Vector2d(east_m, 0), 2);
      return skyline.top_rad(0.5);
    });
  };
  const auto rotated = [&](double degrees) {
    return alike(skyline,
                 [&, degrees](const Eigen::Vector2d&) { return skyline.top_rad(0.5 + radians(degrees)); });
  };
  EXPECT_GT(moved(1), 0.95);
  EXPECT_GT(moved(5), 0.75);
  EXPECT_NEAR(moved(60), unlike, 0.03);
  EXPECT_GT(rotated(2), 0.93);
  EXPECT_GT(rotated(10), 0.7);
  EXPECT_NEAR(rotated(90), unlike, 0.03);
}

// Directions well below a top have the loss behind the same obstacle's edge, as seen just above the edge.
TEST(Skyline, EdgesWeakenAsTheDiffractionOverThem) {
  Skyline skyline(some(), 7);
  const auto level_db = [&](double elevation_rad) {
    const Eigen::Vector3d from = geodesy::enu_from_azimuth_elevation(2, elevation_rad);
    EXPECT_EQ(skyline.level_db({from.x(), from.y(), -from.z()}), skyline.level_db(from));  // by the ground
    return skyline.level_db(from);
  };
  int after = 0;
  for (int i = 0; i < 300; ++i) {
    skyline.go_to({45.0 * i, 0}, 2);
    const double top = skyline.top_rad(2);
    if (top == 0) {
      EXPECT_EQ(level_db(radians(5)), 0);
      continue;
    }
    // P.526-15, 4.1: 6 dB at the edge, about 13 + 20 log nu behind it; the radius adds some.
    EXPECT_LT(level_db(top), -6);
    EXPECT_GT(level_db(top), -9);
    EXPECT_GT(level_db(top + radians(25)), -1.5);
    if (top < radians(20)) continue;
    const double rounded = level_db(top - radians(20)), nearer = level_db(top - radians(10));
    EXPECT_LT(rounded, nearer - 6);
    // nu = angle sqrt(2 d / wavelength) with 2 to 30 m, plus the loss by a radius of 1 m.
    EXPECT_LT(rounded, -13 - 20 * std::log10(radians(20) * std::sqrt(2 * 2 / 0.19)));
    EXPECT_GT(rounded, -13 - 20 * std::log10(radians(20) * std::sqrt(2 * 30 / 0.19)) - 20);
    ++after;
  }
  EXPECT_GT(after, 50);
}

TEST(Skyline, IsEmptyWhereTheSurroundingsHaveNone) {
  ShadowingOptions options;
  EXPECT_FALSE(Skyline(options, 1).empty());
  options.environment = ShadowingEnvironment::Open;
  EXPECT_TRUE(Skyline(options, 1).empty());
  options.skyline.fraction = 0;
  Skyline none(options, 1);
  none.go_to({1, 2}, 3);
  EXPECT_EQ(none.top_rad(1), 0);
  EXPECT_EQ(none.level_db({0, 1, 0}), 0);
}

TEST(SkylineOptions, NameTheFieldThatIsOutOfRange) {
  const test::SpoiledOptions<SkylineOptions> message;
  using O = SkylineOptions;
  using testing::HasSubstr;
  EXPECT_EQ(message([](O&) {}), "");
  EXPECT_THAT(message([](O& o) { o.fraction = 1.1; }), HasSubstr("obstacle_fraction"));
  EXPECT_THAT(message([](O& o) { o.height_m = 0; }), HasSubstr("height_m"));
}

}  // namespace
}  // namespace canyon::disturbance
