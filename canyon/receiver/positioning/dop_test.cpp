#include "canyon/receiver/positioning/least_squares.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"

namespace canyon::positioning {
namespace {

std::vector<Eigen::Vector3d> zenith_and_ring(int n, double elevation_rad, double first_azimuth_rad) {
  std::vector<Eigen::Vector3d> directions{Eigen::Vector3d::UnitZ()};
  for (int i = 0; i < n; ++i) {
    directions.push_back(
        geodesy::enu_from_azimuth_elevation(first_azimuth_rad + 2 * geodesy::kPi * i / n, elevation_rad));
  }
  return directions;
}

// One satellite at the zenith and n >= 3 equally spaced at elevation e, s = sin e: A^T A is n cos^2(e) / 2
// for east and north, and [[1 + n s^2, -(1 + n s)], [-(1 + n s), n + 1]] for up and clock, determinant n (1 -
// s)^2.
TEST(Dop, ZenithAndRingHasItsClosedForm) {
  for (const int n : {3, 4, 7, 30}) {
    for (const double elevation_deg : {0.0, 5.0, 19.47, 60.0, 85.0}) {
      const double e = geodesy::radians(elevation_deg);
      const double s = std::sin(e);
      const auto dop = dop_of_directions(zenith_and_ring(n, e, 0.4));
      ASSERT_TRUE(dop);
      const double hdop2 = 4 / (n * std::cos(e) * std::cos(e));
      const double vdop2 = (n + 1) / (n * (1 - s) * (1 - s));
      const double tdop2 = (1 + n * s * s) / (n * (1 - s) * (1 - s));
      EXPECT_NEAR(dop->hdop, std::sqrt(hdop2), 1e-9 * dop->hdop);
      EXPECT_NEAR(dop->vdop, std::sqrt(vdop2), 1e-9 * dop->vdop);
      EXPECT_NEAR(dop->tdop, std::sqrt(tdop2), 1e-9 * dop->tdop);
      EXPECT_NEAR(dop->pdop, std::sqrt(hdop2 + vdop2), 1e-9 * dop->pdop);
      EXPECT_NEAR(dop->gdop, std::sqrt(hdop2 + vdop2 + tdop2), 1e-9 * dop->gdop);
    }
  }
}

// Zenith and three at -asin(1/3): a regular tetrahedron, A^T A = diag(4/3, 4/3, 4/3, 4) and GDOP^2 = 9/4 +
// 1/4.
TEST(Dop, RegularTetrahedronHasGdopRootFiveHalves) {
  const auto dop = dop_of_directions(zenith_and_ring(3, -std::asin(1.0 / 3), 0));
  ASSERT_TRUE(dop);
  EXPECT_NEAR(dop->gdop, std::sqrt(2.5), 1e-12);
}

TEST(Dop, GeometryWithoutAnAnswerIsEmpty) {
  EXPECT_FALSE(dop_of_directions({}));
  EXPECT_FALSE(dop_of_directions(zenith_and_ring(2, 0.5, 0)));
  // All on one cone about the vertical: height and clock cannot be separated.
  auto cone = zenith_and_ring(8, 0.5, 0);
  cone.erase(cone.begin());
  EXPECT_FALSE(dop_of_directions(cone));
  const std::vector<Eigen::Vector3d> same(6, Eigen::Vector3d::UnitZ());
  EXPECT_FALSE(dop_of_directions(same));
}

// n satellites in each direction divide variances by n: (n A^T A)^-1 = (A^T A)^-1 / n.
TEST(Dop, AnyNumberOfDirections) {
  const std::vector<Eigen::Vector3d> few = zenith_and_ring(4, 0.5, 0);
  const std::size_t copies = kMaxRows / few.size() + 1;
  std::vector<Eigen::Vector3d> many;
  for (std::size_t i = 0; i < copies; ++i) many.insert(many.end(), few.begin(), few.end());
  const std::optional<Dop> one = dop_of_directions(few), all = dop_of_directions(many);
  ASSERT_TRUE(one && all);
  EXPECT_NEAR(all->gdop, one->gdop / std::sqrt(static_cast<double>(copies)), 1e-12);
  EXPECT_NEAR(all->hdop, one->hdop / std::sqrt(static_cast<double>(copies)), 1e-12);
}

// The paper's table II; a bound belongs to the worse class.
TEST(Dop, RatingFollowsThePapersTable) {
  const std::vector<std::pair<double, std::string>> table{{0, "Ideal"},
                                                          {0.999, "Ideal"},
                                                          {1, "Excellent"},
                                                          {1.999, "Excellent"},
                                                          {2, "Good"},
                                                          {4.999, "Good"},
                                                          {5, "Moderate"},
                                                          {9.99, "Moderate"},
                                                          {10, "Fair"},
                                                          {19.99, "Fair"},
                                                          {20, "Poor"},
                                                          {1e6, "Poor"},
                                                          {std::numeric_limits<double>::quiet_NaN(), "Poor"},
                                                          {std::numeric_limits<double>::infinity(), "Poor"}};
  for (const auto& [dop, rating] : table) EXPECT_EQ(name(rate_dop(dop)), rating) << dop;
}

}  // namespace
}  // namespace canyon::positioning
