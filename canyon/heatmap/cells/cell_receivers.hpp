#pragma once

#include "canyon/heatmap/cells/cell_values.hpp"
#include "canyon/heatmap/cells/receiver_draws.hpp"

namespace canyon::heatmap {

/// Layers of a tile by a receiver::Receiver for each cell and draw: for whatever needs CellMethod::Run.
/// Signals are those of simulation::Environment::arrival() at each cell. Const, thread-safe.
///
/// Values without noise are those of draw 0 of a receiver without errors from space that states C/N0 without
/// noise, whose satellites have no constant of their own and no shadow by what the map lacks and an empty
/// street, with the noise taken out of its pseudoranges (its mean stays) and solved by
/// positioning::solve_fix(): weights are what the receiver believes. Availability of signals with strength is
/// the share of draws that have a fix.
class CellReceivers final : public CellSolver {
 public:
  /// As ReceiverDraws. Throws InputError for limits that do not validate().
  CellReceivers(const simulation::Environment& environment, const propagation::Propagator& propagator,
                const simulation::ReceiverConfig& receiver, const DrawOptions& draws,
                const LimitOptions& limits = {});

  [[nodiscard]] bool solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                           std::span<const std::span<float>> layers,
                           const std::function<bool()>& stop) const override;

 private:
  void solve_without_noise(const ReceiverDraws::Scene& scene, CellValues& values) const;
  /// @param space of each draw, or empty
  void draw(const ReceiverDraws::Scene& scene, std::span<const errors::SpaceErrors> space, bool statistics,
            CellValues& values) const;

  ReceiverDraws receivers_;
  LimitOptions limits_;
};

/// TimeToFirstFix: the receiver of each draw begins at the map's time and observes once a second until it has
/// a fix, satellites, paths and streets going on meanwhile. Its knowledge is LimitOptions::start; signals
/// without strength are measured at once. Some hundred times slower than one look: 30 epochs, each traced.
class CellStarts final : public CellSolver {
 public:
  CellStarts(const simulation::Environment& environment, const propagation::Propagator& propagator,
             const simulation::ReceiverConfig& receiver, const DrawOptions& draws,
             const LimitOptions& limits);

  [[nodiscard]] bool solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                           std::span<const std::span<float>> layers,
                           const std::function<bool()>& stop) const override;

 private:
  [[nodiscard]] double first_fix_s(geodesy::GpsTime time, const Eigen::Vector3d& place,
                                   std::span<const errors::SpaceErrors> space) const;

  ReceiverDraws receivers_;
  receiver::ReceiverOptions starting_;
  LimitOptions limits_;
};

}  // namespace canyon::heatmap
