#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/base/geodesy/time_scales.hpp"

namespace canyon::test {

/// A small map with a different value in every cell of every layer, time and altitude, all exact floats.
struct SampleMap {
  heatmap::Request request;
  geodesy::LocalFrame frame{geodesy::Geodetic::from_degrees(22.3, 114.17, 3.2)};

  /// 1 m cells from (-100, -50) on, tiles of 16.
  SampleMap(std::uint32_t columns, std::uint32_t rows) {
    request.grid.west_m = -100;
    request.grid.south_m = -50;
    request.grid.spacing_m = 1;
    request.grid.columns = columns;
    request.grid.rows = rows;
    request.grid.tile_size = 16;
    request.times = {geodesy::parse_time("2019-04-28T12:58:03Z")};
    request.layers = {heatmap::Layer::HorizontalError, heatmap::Layer::Hdop};
  }

  /// One cell in seven is inside a building.
  [[nodiscard]] static heatmap::CellState state(std::size_t altitude, std::uint32_t column,
                                                std::uint32_t row) {
    return (column + 2 * row + altitude) % 7 == 3 ? heatmap::CellState::InsideBuilding
                                                  : heatmap::CellState::Computed;
  }
  /// Exact for fewer than 1000 columns and rows, four layers, two times and altitudes.
  [[nodiscard]] static float value(std::size_t layer, std::size_t time, std::size_t altitude,
                                   std::uint32_t column, std::uint32_t row) {
    if (state(altitude, column, row) != heatmap::CellState::Computed) {
      return std::numeric_limits<float>::quiet_NaN();
    }
    return static_cast<float>(column) + 1000 * static_cast<float>(row) +
           static_cast<float>(4 * layer + 2 * time + altitude) / 16;
  }

  [[nodiscard]] heatmap::MapSource::Slice slice(std::size_t i, std::size_t time) const {
    const heatmap::Tile tile = request.grid.tile(i);
    heatmap::MapSource::Slice result;
    for (std::size_t k = 0; k <= request.layers.size(); ++k) {
      for (std::size_t a = 0; a < request.altitudes_m.size(); ++a) {
        for (std::uint32_t r = tile.first_row; r < tile.first_row + tile.rows; ++r) {
          for (std::uint32_t c = tile.first_column; c < tile.first_column + tile.columns; ++c) {
            if (k < request.layers.size()) {
              result.values.push_back(value(k, time, a, c, r));
            } else {
              result.state.push_back(state(a, c, r));
            }
          }
        }
      }
    }
    return result;
  }

  /// Refers to this map.
  [[nodiscard]] heatmap::MapSource source() const {
    heatmap::MapSource result;
    result.request = &request;
    result.frame = frame;
    result.title = "Sample";
    result.history = "canyon heatmap sample.yaml";
    result.source = "Canyon";
    result.attributes = {{"model", "mirror"}, {"seed", "1"}};
    result.slice = [this](std::size_t i, std::size_t time) { return std::optional(slice(i, time)); };
    return result;
  }
};

}  // namespace canyon::test
