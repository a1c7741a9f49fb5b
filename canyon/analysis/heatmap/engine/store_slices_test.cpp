#include "canyon/analysis/heatmap/engine/map_source.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/circular_sky.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::heatmap {
namespace {

using test::CircularSky;

/// Four times and two altitudes of 2 x 2 tiles, the eastern and northern ones narrower; times in chunks of
/// two.
class StoreSlices : public ::testing::Test {
 protected:
  StoreSlices()
      : environment_(city::synthetic_city({}),
                     std::make_shared<CircularSky>(std::vector{gnss::System::GPS})) {
    Request request;
    request.grid = Grid::covering(-20, -20, 10, 6, 2);
    request.grid.tile_size = 2;
    for (int i = 0; i < 12; ++i) request.times.push_back(CircularSky::kEpoch + std::chrono::hours(1 + i));
    request.altitudes_m = {2, 40};
    map_ = std::make_unique<Heatmap>(environment_, simulation::ReceiverConfig{}, request, "test");
    store_ = std::make_unique<TileStore>(folder_ / "tiles", map_->key(), "a test");
  }

  simulation::Environment environment_;
  test::TemporaryFolder folder_;
  std::unique_ptr<Heatmap> map_;
  std::unique_ptr<TileStore> store_;
};

TEST_F(StoreSlices, CutOutOneTimeOfATile) {
  map_->run(*store_);
  const auto slices = store_slices(*map_, *store_);
  const Request& request = map_->request();
  std::size_t values = 0;
  std::vector<TileValues> units;
  std::size_t longest = 0;
  for (std::size_t i = 0; i < map_->unit_count(); ++i) {
    units.push_back(map_->compute(i));
    longest = std::max(longest, map_->unit(i).times);
  }
  ASSERT_GT(longest, 1U) << "units of one time would not show whether times are told apart";
  // Time by time, then tile by tile, as writers do.
  for (std::size_t time = 0; time < request.times.size(); ++time) {
    for (std::size_t tile = 0; tile < request.grid.tile_count(); ++tile) {
      const auto slice = slices(tile, time);
      ASSERT_TRUE(slice);
      // The unit that contains it, found by searching all; values by the layout of TileValues.
      for (std::size_t i = 0; i < map_->unit_count(); ++i) {
        const Heatmap::Unit unit = map_->unit(i);
        const Tile wanted = request.grid.tile(tile);
        if (unit.tile.first_column != wanted.first_column || unit.tile.first_row != wanted.first_row)
          continue;
        if (time < unit.first_time || time >= unit.first_time + unit.times) continue;
        const TileValues& whole = units[i];
        EXPECT_EQ(slice->state, whole.state);
        const std::size_t cells = wanted.cells();
        ASSERT_EQ(slice->values.size(), request.layers.size() * 2 * cells);
        for (std::size_t layer = 0; layer < request.layers.size(); ++layer) {
          for (std::size_t altitude = 0; altitude < 2; ++altitude) {
            for (std::size_t cell = 0; cell < cells; ++cell, ++values) {
              const float here = slice->values[(layer * 2 + altitude) * cells + cell];
              const float there =
                  whole.values[((layer * unit.times + time - unit.first_time) * 2 + altitude) * cells + cell];
              // Bits, for NaN.
              EXPECT_EQ(std::memcmp(&here, &there, sizeof here), 0)
                  << layer << ' ' << altitude << ' ' << cell;
            }
          }
        }
      }
    }
  }
  EXPECT_EQ(values, request.layers.size() * 12 * 2 * request.grid.cells());
}

TEST_F(StoreSlices, AreEmptyWhereTheStoreHasNone) {
  const std::size_t lost = map_->unit_of(1, 2);
  for (std::size_t i = 0; i < map_->unit_count(); ++i) {
    if (i != lost) store_->save(i, map_->compute(i));
  }
  const auto slices = store_slices(*map_, *store_);
  EXPECT_FALSE(slices(1, 2));
  EXPECT_TRUE(slices(0, 2));
  store_->save(lost, map_->compute(lost));
  EXPECT_TRUE(slices(1, 2));
}

// 1 to 5 in five runs, one of them without a value in the second cell and one without a state in the third:
// mean and quantiles of a further run by hand, at ranks p (n + 1); more satellites are better, larger errors
// are not.
TEST(SlicesOverRuns, AreMeansAndTheBadEnd) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Layer> layers{Layer::HorizontalError, Layer::SatellitesUsed};
  std::vector<std::function<std::optional<MapSource::Slice>(std::size_t, std::size_t)>> runs;
  for (int run = 1; run <= 5; ++run) {
    runs.emplace_back([run](std::size_t, std::size_t) {
      const auto value = static_cast<float>(run);
      MapSource::Slice slice;
      slice.values = {value, run == 5 ? kNan : value, kNan, value, value, value};
      slice.state = {CellState::Computed, CellState::Computed,
                     run == 4 ? CellState::Computed : CellState::InsideBuilding};
      return std::optional(slice);
    });
  }
  const auto mean = slices_over_runs(runs, layers, std::nullopt)(0, 0).value();
  EXPECT_FLOAT_EQ(mean.values[0], 3);
  EXPECT_FLOAT_EQ(mean.values[1], 2.5);
  EXPECT_TRUE(std::isnan(mean.values[2]));
  EXPECT_EQ(mean.state[2], CellState::Computed);
  const auto p95 = slices_over_runs(runs, layers, 0.95)(0, 0).value();
  EXPECT_FLOAT_EQ(p95.values[0], 5);
  EXPECT_FLOAT_EQ(p95.values[1], 4);
  EXPECT_FLOAT_EQ(p95.values[3], 1);
  const auto p25 = slices_over_runs(runs, layers, 0.25)(0, 0).value();
  EXPECT_FLOAT_EQ(p25.values[0], 1.5F);
  EXPECT_FLOAT_EQ(p25.values[3], 4.5F);
  runs.emplace_back([](std::size_t, std::size_t) { return std::nullopt; });
  EXPECT_FALSE(slices_over_runs(runs, layers, std::nullopt)(0, 0));
}

TEST_F(StoreSlices, PassOnThatATileIsDamaged) {
  map_->run(*store_);
  for (const auto& file : std::filesystem::directory_iterator(folder_ / "tiles")) {
    if (file.path().extension() == ".tile") std::filesystem::resize_file(file, 100);
  }
  const auto slices = store_slices(*map_, *store_);
  EXPECT_THROW((void)slices(0, 0), InputError);
}

}  // namespace
}  // namespace canyon::heatmap
