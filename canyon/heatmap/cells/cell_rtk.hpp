#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "canyon/heatmap/cells/cell_solver.hpp"
#include "canyon/heatmap/cells/cell_values.hpp"
#include "canyon/heatmap/kernels/tile_tracer.hpp"
#include "canyon/relative/corrections.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario.hpp"

namespace canyon::heatmap {

/// Layers of RTK: in each cell the receiver of each draw stands still, has tracked for long
/// (SignalLockOptions::warm_start) and knows all ephemerides. From the time of the map on it measures once a
/// second, with the corrections of a base, for LimitOptions::rtk_s. Satellites and paths move meanwhile. The
/// base measures the same sky: draw d of it and of every cell has the same errors from space. Corrections
/// come as relative::CorrectionOptions say. Const, thread-safe.
///
/// Some thousand times slower than one look: each second is traced, and each draw has a filter of its own.
class CellRtk {
 public:
  /// The environment and the propagator must outlive it. @param base with a fixed place, settled
  /// Throws InputError for options that do not validate().
  CellRtk(const simulation::Environment& environment, const propagation::Propagator& propagator,
          const simulation::ReceiverConfig& receiver, const simulation::ReceiverConfig& base,
          const DrawOptions& draws, const LimitOptions& limits);

  /// As CellSolver::solve(), for the layers of_rtk(); others are left alone.
  /// @param stop asked after each row of cells; true leaves the rest
  void solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
             std::span<const std::span<float>> layers, const std::function<bool()>& stop) const;

 private:
  using Corrections = std::shared_ptr<const relative::Corrections>;
  /// [second][draw]; null where the base measured nothing.
  [[nodiscard]] std::vector<std::vector<Corrections>> corrections(
      geodesy::GpsTime time, std::span<const errors::SpaceErrors> space) const;
  void solve_cell(geodesy::GpsTime time, const Eigen::Vector3d& place,
                  std::span<const errors::SpaceErrors> space, std::span<const std::vector<Corrections>> sent,
                  CellValues& values) const;

  const simulation::Environment* environment_;
  const propagation::Propagator* propagator_;
  simulation::ReceiverConfig receiver_, base_;
  propagation::Propagator base_propagator_;
  DrawOptions draws_;
  LimitOptions limits_;
};

}  // namespace canyon::heatmap
