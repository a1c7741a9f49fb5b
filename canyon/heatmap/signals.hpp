#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "canyon/heatmap/grid.hpp"
#include "canyon/heatmap/layers.hpp"
#include "canyon/heatmap/shadows.hpp"
#include "canyon/orbit/sky.hpp"
#include "canyon/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"

namespace canyon::heatmap {

enum class Reception : std::uint8_t { Blocked = 0, LOS = 1, NLOS = 2 };

/// What arrives at the cells of one tile, altitude and time. Satellites are those above the mask at the
/// tile's centre, their directions taken from there (a tile of 256 m: within 6e-6 rad of a cell's own).
struct TileSignals {
  std::vector<orbit::LineOfSight> satellites;  ///< ascending by id, seen from the tile's centre
  std::vector<Eigen::Vector3d> directions;     ///< unit, ENU of the city
  /// [satellite][cell]
  std::vector<std::vector<Reception>> reception;
  std::vector<std::vector<float>> excess_m;  ///< of received satellites; 0 for LOS; empty where not asked for
};

/// Cells of a tile with their heights.
struct TileCells {
  Tile tile;
  CellPlane plane;               ///< where flat(): the plane of all cells
  std::vector<float> z;          ///< ENU of each cell where not flat; empty: flat
  std::vector<CellState> state;  ///< of each cell
  [[nodiscard]] bool flat() const { return z.empty(); }
  [[nodiscard]] Eigen::Vector3d place(std::size_t cell) const;
};

/// How heights are counted.
enum class AltitudeKind : std::uint8_t {
  AboveTerrain,  ///< above the terrain under the cell; where the city has none, above ENU z = 0
  Ellipsoid,     ///< WGS 84 height
};

/// Computes tiles: line of sight by shadows where a tile is flat, else by rays; the mirror model by ranges;
/// the specular model by Propagator::trace(). Const, thread-safe.
class TileTracer {
 public:
  /// The environment must outlive it.
  TileTracer(const simulation::Environment& environment, const propagation::PropagationOptions& options,
             double elevation_mask_rad);
  ~TileTracer();
  TileTracer(TileTracer&&) noexcept;

  /// Places and states of a tile's cells at one altitude.
  [[nodiscard]] TileCells cells(const Grid& grid, const Tile& tile, const Area* area, double altitude_m,
                                AltitudeKind kind) const;
  /// @param excess whether errors are asked for: without, line of sight alone is computed, and satellites
  /// that only reflections bring are Blocked unless `received` (counts of visible satellites need them)
  void trace(const TileCells& cells, geodesy::GpsTime time, bool excess, TileSignals& result) const;
  /// Share of the hemisphere that is clear, for SkyView: `rings` x `sectors` directions of equal solid angle.
  void sky_view(const TileCells& cells, std::span<float> result, int rings = 16, int sectors = 64) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::heatmap
