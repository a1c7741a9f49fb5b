#pragma once

#include <cstdint>
#include <vector>

#include "canyon/analysis/heatmap/cells/cell_fix.hpp"
#include "canyon/analysis/heatmap/cells/cell_values.hpp"
#include "canyon/analysis/heatmap/kernels/tile_tracer.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::heatmap {

/// Layers that depend on the motion.
[[nodiscard]] bool is_motion_layer(Layer layer);

/// Errors of the position filter of a receiver that moves through a tile's cells. The filter follows straight
/// lines through the cells, forwards and backwards: when driving, in the one of four directions with the
/// longest runs of cells; when flying, in all four. In a cell it uses one fix a second,
///   P' = P + q^2 / 12 t,  K = P' / (P' + R / t),  x = x' + K (m - x'),
/// where t is the time in the cell [s], R the reported variance of the cell's fix [m^2], q the density of
/// acceleration (PositionFilterOptions): over a second, white acceleration between two known velocities
/// leaves a position variance of q^2 / 12 (a Brownian bridge's integral). Without a fix it coasts for
/// coast_s. A line starts after uncomputed cells and at the tile's edge; lines are weighted by 1 / P.
class MovingFixes {
 public:
  MovingFixes(const TileCells& cells, std::size_t lanes, const Movement& movement);

  /// Sets the fixes of a cell in all lanes; different cells may be set from different threads.
  void set(std::size_t cell, const std::vector<CellFix::CellSolution>& answers);
  /// Call it once, after all cells are set.
  void filter();
  /// Sets the layers is_motion_layer(), after filter().
  void describe(std::size_t cell, const LimitOptions& limits, bool statistics, CellValues& values) const;

 private:
  /// The fix of one cell and lane. After filter(), `east_m` is the horizontal error and `north_m` 0.
  struct Fix {
    float east_m = 0, north_m = 0, up_m = 0;
    float horizontal_m2 = 0, vertical_m2 = 0;  ///< variances; 0: no fix
  };
  struct TrackFilter;
  template <typename F>
  void sweep(int east, int north, const F& f) const;
  [[nodiscard]] std::vector<std::uint8_t> longest_axes() const;
  void filter_lane(std::size_t lane, const std::vector<std::uint8_t>& axes);

  const TileCells& cells_;
  std::size_t lanes_;
  Movement movement_;
  std::vector<Fix> fixes_;  // [lane][cell]
};

}  // namespace canyon::heatmap
