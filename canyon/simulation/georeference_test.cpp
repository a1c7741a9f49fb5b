#include "canyon/simulation/georeference.hpp"
#include "canyon/simulation/load_city.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/loaded_city.hpp"

namespace canyon::simulation {
namespace {

using geodesy::radians;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

Scenario small_city(const std::string& georeference, int seed) {
  return parse_scenario("city: {facades: {mix: as_given}, synthetic: {blocks_east: 2, blocks_north: 2}" +
                            georeference + "}\nstart: 2026-06-01T12:00:00Z\nseed: " + std::to_string(seed) +
                            "\ntrajectory: {position: {east_m: 1, north_m: 2, up_m: 3}}\n",
                        "s.yaml");
}

// Sample mean, variance and correlation of 1,000 samples: standard errors of normal samples, sigma / sqrt(n),
// sigma sqrt(1 / 2n), 1 / sqrt(n), each times four.
TEST(Georeference, DrawsHaveTheirDeviations) {
  constexpr int kRuns = 1000;
  const Georeference georeference{3, radians(0.4)};
  const double deviation[3] = {3, 3, radians(0.4)};
  Eigen::Matrix<double, kRuns, 3> samples;
  for (int seed = 0; seed < kRuns; ++seed) {
    const auto shift = draw_city_shift(georeference, static_cast<std::uint64_t>(seed));
    ASSERT_TRUE(shift);
    samples.row(seed) << shift->east_m, shift->north_m, shift->heading_rad;
  }
  const Eigen::RowVector3d mean = samples.colwise().mean();
  const Eigen::Matrix<double, kRuns, 3> centred = samples.rowwise() - mean;
  const Eigen::Matrix3d covariance = centred.transpose() * centred / (kRuns - 1);
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(std::abs(mean(i)), 4 * deviation[i] / std::sqrt(kRuns)) << i;
    EXPECT_NEAR(std::sqrt(covariance(i, i)), deviation[i], 4 * deviation[i] / std::sqrt(2.0 * kRuns)) << i;
    for (int j = 0; j < i; ++j) {
      EXPECT_LT(std::abs(covariance(i, j)) / (deviation[i] * deviation[j]), 4 / std::sqrt(kRuns)) << i << j;
    }
  }
}

TEST(Georeference, SameSeedSameMove) {
  const Georeference georeference{2, 0.01};
  const auto a = draw_city_shift(georeference, 7);
  const auto b = draw_city_shift(georeference, 7);
  const auto c = draw_city_shift(georeference, 8);
  EXPECT_EQ(a->east_m, b->east_m);
  EXPECT_EQ(a->north_m, b->north_m);
  EXPECT_EQ(a->heading_rad, b->heading_rad);
  EXPECT_NE(a->east_m, c->east_m);
  // The heading's deviation does not affect the position, nor the reverse.
  const auto position_only = draw_city_shift({2, 0}, 7);
  EXPECT_EQ(position_only->east_m, a->east_m);
  EXPECT_EQ(position_only->heading_rad, 0);
  EXPECT_EQ(draw_city_shift({0, 0.01}, 7)->heading_rad, a->heading_rad);
}

TEST(Georeference, ZeroLeavesEveryBit) {
  EXPECT_FALSE(draw_city_shift({}, 1));
  const Scenario plain = small_city("", 5);
  const Scenario zero = small_city(", georeference: {sigma_m: 0, heading_sigma_deg: 0}", 5);
  const city::City city = load_city(zero);
  EXPECT_EQ(city.mesh.vertices, canyon::test::loaded_city(plain.city).mesh.vertices);
  EXPECT_THAT(city.notes.lines(), IsEmpty());
}

// A box of 4 m x 2 m, rotated by 90 deg about its middle, then 10 m east and 1 m south.
TEST(Georeference, TurnsAboutTheMiddleOfTheBoundsAndMoves) {
  city::City city;
  canyon::test::append_box(city.mesh, "box", city::Surface::Building, city::Material::Concrete, {100, 50, 0},
                           {104, 52, 9});
  move_city(city, {10, -1, geodesy::kPi / 2});
  const city::Box bounds = city.bounds();
  EXPECT_LT((bounds.min - Eigen::Vector3d(111, 48, 0)).norm(), 1e-12);
  EXPECT_LT((bounds.max - Eigen::Vector3d(113, 52, 9)).norm(), 1e-12);
  // Counter-clockwise: the south-eastern corner moves to the north-east.
  city::City corner;
  canyon::test::append_box(corner.mesh, "box", city::Surface::Building, city::Material::Concrete, {-1, -1, 0},
                           {1, 1, 1});
  const Eigen::Vector3d before(1, -1, 0);
  std::size_t at = 0;
  while (corner.mesh.vertices[at] != before) ++at;
  move_city(corner, {0, 0, geodesy::kPi / 2});
  EXPECT_LT((corner.mesh.vertices[at] - Eigen::Vector3d(1, 1, 0)).norm(), 1e-15);
}

TEST(Georeference, LoadingARunsCityMovesItAndSaysSo) {
  const Scenario scenario = small_city(", georeference: {sigma_m: 2, heading_sigma_deg: 0.5}", 11);
  const city::City moved = load_city(scenario);
  city::City expected = canyon::test::loaded_city(scenario.city);
  EXPECT_NE(moved.mesh.vertices, expected.mesh.vertices);
  const auto shift = draw_city_shift({2, radians(0.5)}, 11);
  move_city(expected, *shift);
  EXPECT_EQ(moved.mesh.vertices, expected.mesh.vertices);
  EXPECT_THAT(moved.notes.lines(), ElementsAre(describe(*shift)));
  EXPECT_EQ(describe({2.1, -0.4, radians(0.2)}),
            "city moved by east 2.1 m, north -0.4 m, turned 0.20 deg (georeference)");
}

TEST(Georeference, NothingToMoveIsNoFault) {
  city::City open;
  EXPECT_NO_THROW(move_city(open, {1, 2, 3}));
  EXPECT_TRUE(open.mesh.vertices.empty());
}

}  // namespace
}  // namespace canyon::simulation
