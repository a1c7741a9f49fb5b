#include "canyon/analysis/heatmap/engine/map_summary.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "canyon/city/city.hpp"

namespace canyon::heatmap {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

TEST(ValueCounts, WholeNumbersAreExactByCounting) {
  // 1 to 100: half of them are at or below 50, 95 at or below 95 (by counting).
  ValueCounts counts;
  for (int i = 100; i >= 1; --i) counts.add(static_cast<float>(i));
  counts.add(kNaN);
  EXPECT_EQ(counts.count(), 100U);
  EXPECT_EQ(counts.quantile(0), 1);
  EXPECT_EQ(counts.quantile(0.5), 50);
  EXPECT_EQ(counts.quantile(0.95), 95);
  EXPECT_EQ(counts.quantile(1), 100);
  EXPECT_DOUBLE_EQ(counts.mean(), 50.5);
  EXPECT_EQ(counts.least(), 1);
  EXPECT_EQ(counts.greatest(), 100);
}

TEST(ValueCounts, StaysWithinItsBoundOfSortedValuesOfEitherSign) {
  std::mt19937_64 random(3);
  std::normal_distribution<float> normal(0.3F, 1);
  ValueCounts counts;
  std::vector<float> values(20'001);
  for (float& value : values) {
    // Values over ten orders of magnitude.
    const float size = normal(random);
    value = std::copysign(std::exp(4 * size), normal(random));
    counts.add(value);
  }
  std::sort(values.begin(), values.end());
  for (const double p : {0.0, 0.01, 0.25, 0.5, 0.75, 0.95, 0.999, 1.0}) {
    const auto rank =
        static_cast<std::size_t>(std::max(1.0, std::ceil(p * static_cast<double>(values.size()) - 1e-9)));
    const double exact = values[rank - 1];
    EXPECT_NEAR(counts.quantile(p), exact, std::abs(exact) / 1024 * 1.0001) << p;
  }
}

TEST(ValueCounts, TellsNothingOfNoValueAndTakesExtremes) {
  ValueCounts counts;
  EXPECT_TRUE(std::isnan(counts.quantile(0.5)));
  EXPECT_TRUE(std::isnan(counts.mean()));
  EXPECT_TRUE(std::isnan(counts.least()));
  counts.add(std::numeric_limits<float>::max());
  EXPECT_EQ(counts.quantile(0.5), std::numeric_limits<float>::max());
  counts.add(-std::numeric_limits<float>::infinity());
  counts.add(0);
  EXPECT_EQ(counts.quantile(0.5), 0);
  EXPECT_EQ(counts.quantile(0), -std::numeric_limits<double>::infinity());
}

TEST(FixLayer, PrefersWhatTellsBest) {
  EXPECT_EQ(fix_layer(std::vector{Layer::Hdop, Layer::Availability}), 1U);
  EXPECT_EQ(fix_layer(std::vector{Layer::SatellitesUsed, Layer::HorizontalErrorP95, Layer::Pdop}), 2U);
  EXPECT_EQ(fix_layer(std::vector{Layer::SkyView, Layer::SatellitesUsed}), 1U);
  EXPECT_EQ(fix_layer(std::vector{Layer::SkyView, Layer::SatellitesVisible}), std::nullopt);
  EXPECT_EQ(fix_fraction(Layer::Availability, 0.25F), 0.25);
  EXPECT_EQ(fix_fraction(Layer::SatellitesUsed, 0), 0);
  EXPECT_EQ(fix_fraction(Layer::SatellitesUsed, 5), 1);
  EXPECT_EQ(fix_fraction(Layer::Hdop, kNaN), 0);
  EXPECT_EQ(fix_fraction(Layer::HorizontalError, 3), 1);
}

// 3 x 2 cells in tiles of 2 x 2, two altitudes and times. The horizontal error is 1 + time + 10 altitude in
// computed cells, but NaN in column 0; column 2 (the second tile) is inside a building, and is missing at the
// second time.
TEST(Summarize, CountsCellsStatesValuesAndFixes) {
  Request request;
  request.grid = Grid::covering(0, 0, 3, 2, 1);
  request.grid.tile_size = 2;
  request.altitudes_m = {2, 15};
  request.times = {geodesy::GpsTime{}, geodesy::GpsTime{} + 60.0};
  request.layers = {Layer::SatellitesVisible, Layer::HorizontalError};
  MapSource source;
  source.request = &request;
  source.slice = [&](std::size_t tile, std::size_t time) -> std::optional<MapSource::Slice> {
    if (tile == 1 && time == 1) return std::nullopt;
    const Tile box = request.grid.tile(tile);
    MapSource::Slice slice;
    for (int layer = 0; layer < 2; ++layer) {
      for (int altitude = 0; altitude < 2; ++altitude) {
        for (std::size_t i = 0; i < box.cells(); ++i) {
          if (layer == 0) slice.state.push_back(tile == 0 ? CellState::Computed : CellState::InsideBuilding);
          const float error = i % 2 == 0 ? kNaN : static_cast<float>(1 + time + 10 * altitude);
          slice.values.push_back(tile == 1 ? kNaN : layer == 0 ? 7 : error);
        }
      }
    }
    slice.state.resize(2 * box.cells());
    return slice;
  };
  const MapSummary summary = summarize(source);
  EXPECT_EQ(summary.cells, 12U);
  EXPECT_EQ(summary.in_state(CellState::Computed), 8U);
  EXPECT_EQ(summary.in_state(CellState::InsideBuilding), 4U);
  EXPECT_EQ(summary.missing, 4U);
  EXPECT_EQ(summary.values, 16U);
  ASSERT_TRUE(summary.availability);
  EXPECT_DOUBLE_EQ(*summary.availability, 0.5);
  ASSERT_EQ(summary.layers.size(), 2U);
  EXPECT_EQ(summary.layers[0].layer, Layer::SatellitesVisible);
  EXPECT_EQ(summary.layers[0].values, 16U);
  EXPECT_EQ(summary.layers[0].median, 7);
  // 1, 2, 11, 12, each twice.
  EXPECT_EQ(summary.layers[1].values, 8U);
  EXPECT_DOUBLE_EQ(summary.layers[1].mean, 6.5);
  EXPECT_EQ(summary.layers[1].median, 2);
  EXPECT_EQ(summary.layers[1].p95, 12);
  EXPECT_EQ(summary.layers[1].least, 1);
  EXPECT_EQ(summary.layers[1].greatest, 12);
}

}  // namespace
}  // namespace canyon::heatmap
