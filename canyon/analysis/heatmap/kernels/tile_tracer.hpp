#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "canyon/analysis/heatmap/kernels/grid.hpp"
#include "canyon/analysis/heatmap/kernels/layers.hpp"
#include "canyon/analysis/heatmap/kernels/shadows.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::heatmap {

enum class CellVisibility : std::uint8_t { Blocked = 0, LOS = 1, NLOS = 2 };

/// Signals that arrive at the cells of one tile, altitude and time. Satellites are those above the mask at
/// the tile's centre. Directions are those at the centre (a tile of 256 m: within 1e-5 rad of a cell's own).
struct TileSignals {
  std::vector<orbit::LineOfSight> satellites;  ///< ascending by id, seen from the tile's centre
  std::vector<Eigen::Vector3d> directions;     ///< unit, ENU of the city
  /// [satellite][cell]
  std::vector<std::vector<CellVisibility>> visibility;
  std::vector<std::vector<float>> excess_m;  ///< of received satellites; 0 for LOS; empty if not requested
};

/// Cells of a tile with their heights.
struct TileCells {
  Tile tile;
  CellPlane plane;               ///< if flat(): the plane of all cells
  std::vector<float> z;          ///< ENU of each cell if not flat (NaN: no terrain); empty: flat
  std::vector<CellState> state;  ///< of each cell
  /// Computed cells of a flat tile that are on a wall (within RayScene::surface_offset_m()), ascending: they
  /// use rays, which ignore surfaces that touch the point.
  std::vector<std::uint32_t> on_walls;
  [[nodiscard]] bool flat() const { return z.empty(); }
  /// Centre of a cell, ENU [m].
  [[nodiscard]] Eigen::Vector3d centre(std::size_t cell) const;
};

/// Reference of heights.
enum class AltitudeKind : std::uint8_t {
  AboveTerrain,  ///< above the terrain under the cell; without terrain, above ENU z = 0
  Ellipsoid,     ///< WGS 84 height
};

/// The signal of a satellite that a receiver measures first; null: it tracks none.
using FirstSignal = std::function<const gnss::Signal*(gnss::SatelliteId, geodesy::GpsTime)>;

/// Computes tiles: line of sight by shadows if a tile is flat, else by rays; the mirror model by ranges; the
/// specular model by Propagator::trace() for satellites whose line of sight is blocked. Work is distributed
/// over the calling task arena's threads (TBB); values do not depend on them. Const, thread-safe.
class TileTracer {
 public:
  /// The environment must outlive it; it has no movable instances. Throws InputError for options that do not
  /// validate() and a mask not in [0, pi/2). @param first_signal empty: all satellites, the signal near L1
  TileTracer(const simulation::Environment& environment, const propagation::PropagationOptions& options,
             double elevation_mask_rad, FirstSignal first_signal = {});
  ~TileTracer();
  TileTracer(TileTracer&&) noexcept;

  [[nodiscard]] const propagation::Propagator& propagator() const;

  /// Points and states of a tile's cells at one altitude [m, finite]. State, in this order: outside the area
  /// (null: no limit); no terrain below the cell in a city with terrain (AboveTerrain); else
  /// RayScene::containment() of the point. A tile is flat if its cells' heights agree within 1 mm; its plane
  /// is at the mean of their extremes. If no cell is Computed, `plane.z` may be 0.
  [[nodiscard]] TileCells cells(const Grid& grid, const Tile& tile, const Area* area, double altitude_m,
                                AltitudeKind kind) const;
  /// Satellites above the horizon and the mask at the middle of the tile that the receiver tracks, and their
  /// visibility at its cells. Computed cells only: others are Blocked. Same result as Propagator::trace()
  /// with the tile's directions, within RayScene::surface_offset_m() of edges to either side; a direct path
  /// with reflections is LOS.
  /// @param excess whether paths beyond the line of sight are requested (LayerInfo::received). Without, only
  /// line of sight is computed, satellites received only by reflections are Blocked, and
  /// TileSignals::excess_m is empty. @param result overwritten; its memory is reused
  void trace(const TileCells& cells, geodesy::GpsTime time, bool excess, TileSignals& result) const;
  /// Clear fraction of the hemisphere, for SkyView: `rings` x `sectors` directions of equal solid angle
  /// (rings of equal height, every other one rotated by half a sector), each in [1, 1000]; NaN in cells that
  /// are not Computed. Foliage blocks. Within 0.01 for the defaults, assuming smooth surroundings.
  void sky_view(const TileCells& cells, std::span<float> result, int rings = 16, int sectors = 64) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::heatmap
