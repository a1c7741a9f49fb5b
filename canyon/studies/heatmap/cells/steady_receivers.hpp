#pragma once

#include <optional>
#include <span>

#include "canyon/run/environment.hpp"
#include "canyon/run/scenario/scenario.hpp"
#include "canyon/studies/heatmap/cells/cell_solver.hpp"
#include "canyon/studies/heatmap/cells/moving_fixes.hpp"
#include "canyon/studies/heatmap/kernels/tile_tracer.hpp"

namespace canyon::heatmap {

/// Layers of a tile as CellReceivers has them, without running receivers: the same draws, the same paths'
/// strengths and random phases, loops where they rest (tracking::LaneCodeLock), the fix linear about the
/// place (CellFix). Paths are traced at one cell of each block of cells (a node) and constructed anew at
/// the cells about it (Propagator::trace_near()): paths that no node about a cell has are missed there;
/// diffuse paths are those of the block's node. docs/heatmap.md states what that costs. Directions
/// are those of a tile's centre. Const, thread-safe.
class SteadyReceivers final : public CellSolver {
 public:
  /// The environment and the propagator must outlive it. @param receiver for which CellMethod::Steady holds
  /// @param path_nodes_m most distance of nodes; 0: one in every cell
  /// @param movement empty: the receiver stands in each cell. Throws InputError for options that do not
  /// validate().
  SteadyReceivers(const simulation::Environment& environment, const propagation::Propagator& propagator,
                  const simulation::ReceiverConfig& receiver, const DrawOptions& draws,
                  const LimitOptions& limits, double path_nodes_m,
                  const std::optional<Movement>& movement = {});

  [[nodiscard]] bool solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                           std::span<const std::span<float>> layers,
                           const std::function<bool()>& stop) const override;

 private:
  const simulation::Environment* environment_;
  const propagation::Propagator* propagator_;
  receiver::ReceiverOptions options_;
  DrawOptions draws_;
  LimitOptions limits_;
  double path_nodes_m_;
  std::optional<Movement> movement_;
};

}  // namespace canyon::heatmap
