#include "canyon/analysis/heatmap/kernels/grid.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector2d;

TEST(Grid, CoversTheBoxWithWholeCells) {
  const Grid grid = Grid::covering(-10, -20, 15.5, 30, 2);
  EXPECT_EQ(grid.columns, 13U);  // 25.5 m
  EXPECT_EQ(grid.rows, 25U);
  EXPECT_EQ(grid.east_m(), 16);
  EXPECT_EQ(grid.north_m(), 30);
  EXPECT_EQ(grid.centre(0, 0), Vector2d(-9, -19));
  EXPECT_EQ(grid.centre(12, 24), Vector2d(15, 29));
  EXPECT_EQ(grid.cells(), 325U);
  // 0.1 does not divide 0.3 in doubles: rounding does not add a column.
  EXPECT_EQ(Grid::covering(0, 0, 0.3, 0.7, 0.1).columns, 3U);
  EXPECT_EQ(Grid::covering(0, 0, 0.3, 0.7, 0.1).rows, 7U);
  EXPECT_EQ(Grid::covering(0, 0, 0.005, 0.005, 1).cells(), 1U);
}

TEST(Grid, RefusesBoxesThatAreNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)Grid::covering(0, 0, 0, 1, 1), InputError);
  EXPECT_THROW((void)Grid::covering(0, 2, 1, 1, 1), InputError);
  EXPECT_THROW((void)Grid::covering(nan, 0, 1, 1, 1), InputError);
  EXPECT_THROW((void)Grid::covering(0, 0, 1, std::numeric_limits<double>::infinity(), 1), InputError);
  for (const double spacing : {0.0, -1.0, 0.009, 10'001.0, nan}) {
    EXPECT_THROW((void)Grid::covering(0, 0, 1, 1, spacing), InputError) << spacing;
  }
  EXPECT_THROW((void)Grid::covering(0, 0, 3e7, 1, 0.01), InputError);
  EXPECT_NO_THROW((void)Grid::covering(0, 0, 2.1e7, 1, 0.01));
  Grid none = Grid::covering(0, 0, 5, 5, 1);
  EXPECT_NO_THROW(options::check(none, "grid"));
  none.columns = 0;
  EXPECT_THROW(options::check(none, "grid"), InputError);
  none = Grid::covering(0, 0, 5, 5, 1);
  none.tile_size = 0;
  EXPECT_THROW(options::check(none, "grid"), InputError);
}

TEST(Grid, TilesHaveEveryCellOnce) {
  for (const std::uint32_t size : {1U, 7U, 16U, 300U}) {
    Grid grid = Grid::covering(0, 0, 53, 31, 1);
    grid.tile_size = size;
    std::vector<int> seen(grid.cells());
    for (std::size_t i = 0; i < grid.tile_count(); ++i) {
      const Tile tile = grid.tile(i);
      EXPECT_LE(tile.columns, size);
      EXPECT_LE(tile.rows, size);
      for (std::uint32_t r = 0; r < tile.rows; ++r) {
        for (std::uint32_t c = 0; c < tile.columns; ++c) {
          ++seen.at(std::size_t{tile.first_row + r} * grid.columns + tile.first_column + c);
        }
      }
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<std::ptrdiff_t>(seen.size())) << size;
  }
}

TEST(Grid, TilesOfWideCellsAreNotWiderThanASharedDirectionBears) {
  EXPECT_EQ(Grid::covering(0, 0, 5000, 5000, 4).tile_size, 256U);
  EXPECT_EQ(Grid::covering(0, 0, 5000, 5000, 5).tile_size, 128U);
  EXPECT_EQ(Grid::covering(0, 0, 50000, 50000, 500).tile_size, 16U);
}

TEST(Area, HolesAndSeveralPolygonsByEvenOdd) {
  // A square of 10 with a hole of 4, and a separate triangle.
  const Area area{{{{0, 0}, {10, 0}, {10, 10}, {0, 10}},
                   {{3, 3}, {7, 3}, {7, 7}, {3, 7}, {3, 3}},
                   {{20, 0}, {30, 0}, {25, 10}}}};
  EXPECT_TRUE(area.contains({1, 1}));
  EXPECT_FALSE(area.contains({5, 5}));
  EXPECT_TRUE(area.contains({8, 5}));
  EXPECT_TRUE(area.contains({25, 9}));
  EXPECT_FALSE(area.contains({21, 9}));
  EXPECT_FALSE(area.contains({15, 5}));
  EXPECT_EQ(area.bounds().first, Vector2d(0, 0));
  EXPECT_EQ(area.bounds().second, Vector2d(30, 10));
  EXPECT_THROW(Area{}.validate(), InputError);
  EXPECT_THROW((Area{{{{0, 0}, {1, 1}}}}.validate()), InputError);
  EXPECT_NO_THROW(area.validate());
}

// Closed form: a regular polygon of 720 corners has the area n r^2 sin(2 pi / n) / 2.
TEST(Area, MaskOfTilesIsThatOfEachCell) {
  std::vector<Vector2d> round, star;
  for (int i = 0; i < 720; ++i) {
    const double angle = 2 * geodesy::kPi * i / 720;
    round.emplace_back(40 * std::cos(angle) + 1.3, 40 * std::sin(angle) - 2.1);
  }
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(-50, 50);
  for (int i = 0; i < 40; ++i) star.emplace_back(unit(random), unit(random));  // crosses itself
  // Corners exactly at the centres of cells.
  const std::vector<Vector2d> on_centres{{-49.5, -49.5}, {-29.5, -49.5}, {-29.5, -29.5}, {-49.5, -29.5}};
  Grid grid = Grid::covering(-50, -50, 50, 50, 1);
  grid.tile_size = 32;
  for (const Area& area : {Area{{round}}, Area{{star}}, Area{{round, star, on_centres}}}) {
    std::size_t inside = 0;
    for (std::size_t i = 0; i < grid.tile_count(); ++i) {
      const Tile tile = grid.tile(i);
      const std::vector<std::uint8_t> mask = area.mask(grid, tile);
      ASSERT_EQ(mask.size(), tile.cells());
      for (std::uint32_t r = 0; r < tile.rows; ++r) {
        for (std::uint32_t c = 0; c < tile.columns; ++c) {
          const bool in = area.contains(grid.centre(tile.first_column + c, tile.first_row + r));
          ASSERT_EQ(mask[std::size_t{r} * tile.columns + c], in ? 1 : 0);
          inside += in;
        }
      }
    }
    EXPECT_GT(inside, 1000U);
    if (area.rings.size() == 1 && area.rings[0].size() == 720) {
      EXPECT_NEAR(static_cast<double>(inside), 720 * 1600 * std::sin(2 * geodesy::kPi / 720) / 2, 20);
    }
  }
}

}  // namespace
}  // namespace canyon::heatmap
