#include "canyon/analysis/heatmap/kernels/grid.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector2d;

std::size_t tiles_along(std::uint32_t cells, std::uint32_t tile_size) {
  return (std::size_t{cells} + tile_size - 1) / tile_size;
}

/// East coordinate of the intersection of edge a-b with the line y, if any. Half open in y, so that a line
/// through a corner counts its two edges once or twice as required.
std::optional<double> crossing(const Vector2d& a, const Vector2d& b, double y) {
  if ((a.y() <= y) == (b.y() <= y)) return std::nullopt;
  return a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
}

}  // namespace

std::size_t Grid::tiles_across() const {
  return tiles_along(columns, tile_size);
}

std::size_t Grid::tile_count() const {
  return tiles_across() * tiles_along(rows, tile_size);
}

Tile Grid::tile(std::size_t i) const {
  assert(i < tile_count());
  const std::size_t across = tiles_across();
  Tile tile;
  tile.first_column = static_cast<std::uint32_t>(i % across) * tile_size;
  tile.first_row = static_cast<std::uint32_t>(i / across) * tile_size;
  tile.columns = std::min(tile_size, columns - tile.first_column);
  tile.rows = std::min(tile_size, rows - tile.first_row);
  return tile;
}

void visit(options::Visitor& v, Grid& o) {
  constexpr std::uint32_t kMax = std::uint32_t{1} << 31;
  v.number({"west_m", "m", "western edge, east of the city's origin"}, o.west_m, {});
  v.number({"south_m", "m", "southern edge, north of it"}, o.south_m, {});
  v.number({"spacing_m", "m", "side of a cell"}, o.spacing_m, {0.01, 10'000});
  v.integer({"columns", "cells", "from west to east"}, o.columns, 1, kMax);
  v.integer({"rows", "cells", "from south to north"}, o.rows, 1, kMax);
  v.integer({"tile_size", "cells", "width of a tile", "256, fewer if these are wider than 1024 m"},
            o.tile_size, 1, 4096);
}

Grid Grid::covering(double west_m, double south_m, double east_m, double north_m, double spacing_m) {
  for (const double side : {west_m, south_m, east_m, north_m}) {
    if (std::isfinite(side)) continue;
    throw InputError(
        fmt::format("the box [{}, {}] x [{}, {}] m is not finite", west_m, east_m, south_m, north_m),
        "give metres east and north of the city's origin");
  }
  if (!(west_m < east_m && south_m < north_m)) {
    throw InputError(fmt::format("the box [{}, {}] x [{}, {}] m is empty", west_m, east_m, south_m, north_m),
                     "give west below east and south below north");
  }
  if (!(spacing_m >= 0.01 && spacing_m <= 10'000)) {
    throw InputError(fmt::format("a grid spacing of {} m is out of range", spacing_m),
                     "give 0.01 to 10,000 m");
  }
  // A millionth of a cell more is rounding, not a further cell.
  const auto cells = [&](double low, double high) {
    return std::max(1.0, std::ceil((high - low) / spacing_m - 1e-6));
  };
  const double columns = cells(west_m, east_m), rows = cells(south_m, north_m);
  if (columns > 0x1p31 || rows > 0x1p31) {
    throw InputError(fmt::format("{:.0f} x {:.0f} cells of {} m are too many", columns, rows, spacing_m),
                     "give a larger spacing or a smaller box: at most 2^31 columns and rows");
  }
  Grid grid;
  grid.west_m = west_m;
  grid.south_m = south_m;
  grid.spacing_m = spacing_m;
  grid.columns = static_cast<std::uint32_t>(columns);
  grid.rows = static_cast<std::uint32_t>(rows);
  // All cells of a tile use the same satellite directions: tiles of wide cells have fewer cells.
  while (grid.tile_size > 16 && grid.tile_size * spacing_m > kWidestTile_m) grid.tile_size /= 2;
  return grid;
}

bool Area::contains(const Vector2d& point) const {
  bool inside = false;
  for (const std::vector<Vector2d>& ring : rings) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const auto x = crossing(ring[i], ring[i + 1 < ring.size() ? i + 1 : 0], point.y());
      if (x && *x > point.x()) inside = !inside;
    }
  }
  return inside;
}

std::vector<std::uint8_t> Area::mask(const Grid& grid, const Tile& tile) const {
  std::vector<std::vector<double>> crossings(tile.rows);
  const auto row_below = [&](double y) {
    // The last row of the tile with centres at or below y, plus one; checked exactly below.
    const double row = (y - grid.south_m) / grid.spacing_m - 0.5 - tile.first_row;
    return std::clamp(std::floor(row), -2.0, tile.rows + 1.0);
  };
  for (const std::vector<Vector2d>& ring : rings) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vector2d &a = ring[i], &b = ring[i + 1 < ring.size() ? i + 1 : 0];
      const auto first = std::max(0.0, row_below(std::min(a.y(), b.y())) - 1);
      const auto last = std::min(tile.rows - 1.0, row_below(std::max(a.y(), b.y())) + 1);
      for (auto row = static_cast<std::int64_t>(first); row <= static_cast<std::int64_t>(last); ++row) {
        const auto r = static_cast<std::uint32_t>(row);
        const double y = grid.centre(tile.first_column, tile.first_row + r).y();
        if (const auto x = crossing(a, b, y)) crossings[r].push_back(*x);
      }
    }
  }
  std::vector<std::uint8_t> mask(tile.cells());
  for (std::uint32_t r = 0; r < tile.rows; ++r) {
    std::vector<double>& xs = crossings[r];
    std::sort(xs.begin(), xs.end());
    std::size_t passed = 0;
    for (std::uint32_t c = 0; c < tile.columns; ++c) {
      const double x = grid.centre(tile.first_column + c, tile.first_row).x();
      while (passed < xs.size() && !(xs[passed] > x)) ++passed;
      mask[std::size_t{r} * tile.columns + c] = (xs.size() - passed) % 2;
    }
  }
  return mask;
}

std::pair<Vector2d, Vector2d> Area::bounds() const {
  assert(!rings.empty());
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  std::pair<Vector2d, Vector2d> bounds{{kInfinite, kInfinite}, {-kInfinite, -kInfinite}};
  for (const std::vector<Vector2d>& ring : rings) {
    for (const Vector2d& point : ring) {
      bounds.first = bounds.first.cwiseMin(point);
      bounds.second = bounds.second.cwiseMax(point);
    }
  }
  return bounds;
}

void Area::validate() const {
  if (rings.empty()) throw InputError("the area has no polygon", "give at least one");
  for (const std::vector<Vector2d>& ring : rings) {
    if (ring.size() < 3)
      throw InputError(fmt::format("a ring of the area has {} corners", ring.size()), "give at least three");
    for (const Vector2d& point : ring) {
      if (!point.allFinite()) {
        throw InputError(fmt::format("a corner of the area ({}, {}) is not finite", point.x(), point.y()),
                         "give metres east and north of the city's origin");
      }
    }
  }
}

}  // namespace canyon::heatmap
