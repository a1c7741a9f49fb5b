#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "canyon/heatmap/engine/map_source.hpp"

namespace canyon::heatmap {

/// The content of a pixel of a map.
enum class Shade : std::uint8_t {
  Value,
  NoValue,  ///< computed, but NaN: no fix, or nothing received
  InsideBuilding,
  UnderTerrain,
  NotComputed,  ///< of an interrupted run
  Nothing,      ///< outside the area, or no terrain
};
inline constexpr std::size_t kShades = 6;

/// One layer at one time and altitude, averaged down; rows from the top (north).
struct PanelRaster {
  std::vector<float> values;  ///< NaN where the shade is not Value
  std::vector<Shade> shades;
};

struct RasterSize {
  std::uint32_t columns = 1, rows = 1;
  [[nodiscard]] std::size_t pixels() const { return std::size_t{columns} * rows; }
  [[nodiscard]] bool operator==(const RasterSize&) const = default;
};

/// All layers and altitudes of one time, [altitude][layer], tile by tile. Every cell goes to the one pixel
/// that its centre is in: to column c * size.columns / columns of the grid, and rows likewise. A pixel is
/// Value with their mean where at least half of its cells have one, else what most of them are.
/// @param size neither side larger than the grid's (asserted)
[[nodiscard]] std::vector<std::vector<PanelRaster>> reduce(const MapSource& source, std::size_t time,
                                                           const RasterSize& size);

}  // namespace canyon::heatmap
