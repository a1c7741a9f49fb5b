#pragma once

#include <memory>
#include <span>
#include <vector>

#include "canyon/heatmap/cells/cell_values.hpp"
#include "canyon/heatmap/cells/receiver_draws.hpp"
#include "canyon/relative/corrections.hpp"

namespace canyon::heatmap {

/// Layers of RTK: in each cell the receiver of each draw stands still, has tracked for long
/// (SignalLockOptions::warm_start) and knows all ephemerides. From the time of the map on it measures once a
/// second, with the corrections of a base, for LimitOptions::rtk_s. Satellites and paths move meanwhile. The
/// base measures the same sky: draw d of it and of every cell has the same errors from space. Corrections
/// come as relative::CorrectionOptions say. Const, thread-safe.
///
/// Some thousand times slower than one look: each second is traced, and each draw has a filter of its own.
class CellRtk final : public CellSolver {
 public:
  /// As ReceiverDraws. @param base with a fixed place, settled. Throws InputError for too many epochs of it.
  CellRtk(const simulation::Environment& environment, const propagation::Propagator& propagator,
          const simulation::ReceiverConfig& receiver, const simulation::ReceiverConfig& base,
          const DrawOptions& draws, const LimitOptions& limits);
  CellRtk(const CellRtk&) = delete;
  CellRtk& operator=(const CellRtk&) = delete;

  [[nodiscard]] bool solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                           std::span<const std::span<float>> layers,
                           const std::function<bool()>& stop) const override;

 private:
  using Corrections = std::shared_ptr<const relative::Corrections>;
  /// [second][draw]; null where the base measured nothing.
  [[nodiscard]] std::vector<std::vector<Corrections>> corrections(
      geodesy::GpsTime time, std::span<const errors::SpaceErrors> space) const;
  void solve_cell(geodesy::GpsTime time, const Eigen::Vector3d& place,
                  std::span<const errors::SpaceErrors> space, std::span<const std::vector<Corrections>> sent,
                  CellValues& values) const;

  propagation::Propagator base_propagator_;
  ReceiverDraws rovers_, bases_;
  geodesy::Geodetic base_place_;
  LimitOptions limits_;
};

}  // namespace canyon::heatmap
