#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/options/fwd.hpp"

namespace canyon::heatmap {

/// Maximum width of tiles of Grid::covering(), as long as they have more than 16 cells across. The
/// satellites' directions of a whole tile are those of its centre, 724 m from a corner: for a satellite
/// overhead, 20,200 km away (GPS), 3.6e-5 rad from the corner's (GLONASS: 3.8e-5).
inline constexpr double kWidestTile_m = 1024;

/// A part of a grid: columns [first_column, first_column + columns), rows likewise.
struct Tile {
  std::uint32_t first_column = 0, first_row = 0;
  std::uint32_t columns = 0, rows = 0;
  [[nodiscard]] std::size_t cells() const { return std::size_t{columns} * rows; }
};

/// Square cells in the city's east-north plane, row 0 southernmost, column 0 westernmost; values at centres.
struct Grid {
  double west_m = 0, south_m = 0;  ///< outer edges, ENU of the city
  double spacing_m = 2;
  std::uint32_t columns = 0, rows = 0;
  std::uint32_t tile_size = 256;  ///< cells across, [1, 4096]

  [[nodiscard]] Eigen::Vector2d centre(std::uint32_t column, std::uint32_t row) const {
    return {west_m + (column + 0.5) * spacing_m, south_m + (row + 0.5) * spacing_m};
  }
  [[nodiscard]] double east_m() const { return west_m + columns * spacing_m; }
  [[nodiscard]] double north_m() const { return south_m + rows * spacing_m; }
  [[nodiscard]] std::size_t cells() const { return std::size_t{columns} * rows; }
  [[nodiscard]] std::size_t tile_count() const;
  [[nodiscard]] std::size_t tiles_across() const;  ///< in one row of tiles
  /// Tiles by rows of tiles from the south-west corner on. @param i below tile_count() (asserted)
  [[nodiscard]] Tile tile(std::size_t i) const;
  [[nodiscard]] bool operator==(const Grid&) const = default;

  /// The grid that covers [west, east] x [south, north] with whole cells. Throws InputError for a box that is
  /// empty or not finite, a spacing not in [0.01, 10,000] m, and more than 2^31 columns or rows. Tiles are
  /// 256 cells across, fewer (down to 16) if they would be wider than kWidestTile_m.
  [[nodiscard]] static Grid covering(double west_m, double south_m, double east_m, double north_m,
                                     double spacing_m);
};
void visit(options::Visitor& v, Grid& o);

/// Polygons in which cells must be (centres, even-odd rule, holes as further rings), ENU of the city [m].
/// Rings need not be closed; a last corner that repeats the first is allowed. Points on an edge are on either
/// side of it, on the same one for all calls.
struct Area {
  std::vector<std::vector<Eigen::Vector2d>> rings;

  [[nodiscard]] bool contains(const Eigen::Vector2d& point) const;
  /// 1 for cells of a tile for whose centre contains() is true, else 0: row by row, each edge once.
  [[nodiscard]] std::vector<std::uint8_t> mask(const Grid& grid, const Tile& tile) const;
  /// Bounds: min and max corner. The area must have a ring.
  [[nodiscard]] std::pair<Eigen::Vector2d, Eigen::Vector2d> bounds() const;
  /// Throws InputError without a ring, for a ring of fewer than three corners, and for a corner not finite.
  void validate() const;
};
}  // namespace canyon::heatmap
