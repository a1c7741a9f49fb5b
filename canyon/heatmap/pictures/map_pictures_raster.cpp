#include "canyon/heatmap/pictures/map_pictures_raster.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

namespace canyon::heatmap {
namespace {

/// Sums of one layer at one altitude.
struct Sums {
  std::vector<float> values;  ///< float: colours need no more, and there are many
  std::vector<std::uint32_t> counts;
};

Shade shade_of(CellState state) {
  switch (state) {
    case CellState::Computed:
      return Shade::NoValue;  // unless there is one
    case CellState::InsideBuilding:
      return Shade::InsideBuilding;
    case CellState::UnderTerrain:
      return Shade::UnderTerrain;
    case CellState::OutsideArea:
    case CellState::NoTerrain:
      break;
  }
  return Shade::Nothing;
}

class Reduction {
 public:
  Reduction(const Request& request, const RasterSize& size)
      : request_(request), grid_(request.grid), size_(size), shades_(request.altitudes_m.size()) {
    assert(size.columns >= 1 && size.columns <= grid_.columns && size.rows >= 1 && size.rows <= grid_.rows);
    for (auto& shades : shades_) shades.resize(size.pixels());
    sums_.resize(request.layers.size() * request.altitudes_m.size());
    for (Sums& sums : sums_) {
      sums.values.resize(size.pixels());
      sums.counts.resize(size.pixels());
    }
  }

  void add(const Tile& tile, const std::optional<MapSource::Slice>& slice) {
    const std::size_t cells = tile.cells(), altitudes = request_.altitudes_m.size();
    assert(!slice || slice->state.size() == altitudes * cells);
    assert(!slice || slice->values.size() == request_.layers.size() * altitudes * cells);
    const std::vector<std::size_t> pixels = pixels_of(tile);
    for (std::size_t altitude = 0; altitude < altitudes; ++altitude) {
      const std::size_t states = altitude * cells;
      for (std::size_t i = 0; i < cells; ++i) {
        const Shade shade = slice ? shade_of(slice->state[states + i]) : Shade::NotComputed;
        ++shades_[altitude][pixels[i]][static_cast<std::size_t>(shade)];
      }
      if (!slice) continue;
      for (std::size_t layer = 0; layer < request_.layers.size(); ++layer) {
        Sums& sums = sums_[layer * altitudes + altitude];
        const float* values = slice->values.data() + (layer * altitudes + altitude) * cells;
        for (std::size_t i = 0; i < cells; ++i) {
          if (slice->state[states + i] != CellState::Computed || std::isnan(values[i])) continue;
          sums.values[pixels[i]] += values[i];
          ++sums.counts[pixels[i]];
        }
      }
    }
  }

  [[nodiscard]] PanelRaster raster(std::size_t altitude, std::size_t layer) const {
    const Sums& sums = sums_[layer * request_.altitudes_m.size() + altitude];
    PanelRaster raster;
    raster.values.assign(size_.pixels(), std::numeric_limits<float>::quiet_NaN());
    raster.shades.resize(size_.pixels());
    for (std::size_t p = 0; p < size_.pixels(); ++p) {
      std::array<std::uint32_t, kShades> counts = shades_[altitude][p];
      std::uint32_t cells = 0;
      for (const std::uint32_t n : counts) cells += n;
      if (sums.counts[p] > 0 && 2 * std::uint64_t{sums.counts[p]} >= cells) {
        raster.values[p] = sums.values[p] / static_cast<float>(sums.counts[p]);
        raster.shades[p] = Shade::Value;
        continue;
      }
      counts[static_cast<std::size_t>(Shade::NoValue)] -= sums.counts[p];
      raster.shades[p] =
          static_cast<Shade>(std::max_element(counts.begin() + 1, counts.end()) - counts.begin());
    }
    return raster;
  }

 private:
  [[nodiscard]] std::vector<std::size_t> pixels_of(const Tile& tile) const {
    std::vector<std::size_t> pixels;
    pixels.reserve(tile.cells());
    for (std::uint32_t r = 0; r < tile.rows; ++r) {
      const std::uint64_t from_top = grid_.rows - 1 - (tile.first_row + r);
      const std::size_t row = from_top * size_.rows / grid_.rows;
      for (std::uint32_t c = 0; c < tile.columns; ++c) {
        pixels.push_back(row * size_.columns +
                         std::uint64_t{tile.first_column + c} * size_.columns / grid_.columns);
      }
    }
    return pixels;
  }

  const Request& request_;
  const Grid& grid_;
  RasterSize size_;
  std::vector<std::vector<std::array<std::uint32_t, kShades>>> shades_;  ///< [altitude][pixel]
  std::vector<Sums> sums_;                                               ///< [layer][altitude]
};

}  // namespace

std::vector<std::vector<PanelRaster>> reduce(const MapSource& source, std::size_t time,
                                             const RasterSize& size) {
  const Request& request = *source.request;
  Reduction reduction(request, size);
  for (std::size_t tile = 0; tile < request.grid.tile_count(); ++tile) {
    reduction.add(request.grid.tile(tile), source.slice(tile, time));
  }
  std::vector<std::vector<PanelRaster>> rasters(request.altitudes_m.size());
  for (std::size_t altitude = 0; altitude < rasters.size(); ++altitude) {
    for (std::size_t layer = 0; layer < request.layers.size(); ++layer) {
      rasters[altitude].push_back(reduction.raster(altitude, layer));
    }
  }
  return rasters;
}

}  // namespace canyon::heatmap
