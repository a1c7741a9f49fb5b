#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "canyon/heatmap/cells/cell_solver.hpp"
#include "canyon/heatmap/cells/cell_values.hpp"
#include "canyon/heatmap/kernels/tile_tracer.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario.hpp"
#include "canyon/simulation/street_sources.hpp"

namespace canyon::heatmap {

/// Errors from space of draws 0 to count - 1 at a time, each by its seed_of(); empty where the environment
/// has none.
[[nodiscard]] std::vector<errors::SpaceErrors> space_of_draws(const simulation::Environment& environment,
                                                              const DrawOptions& draws, geodesy::GpsTime time,
                                                              int count,
                                                              std::span<const gnss::SatelliteId> satellites);

/// A copy with the errors from space of one draw; without any where `space` is empty.
[[nodiscard]] propagation::Arrival with_space(propagation::Arrival arrival,
                                              std::span<const errors::SpaceErrors> space, std::size_t draw,
                                              const propagation::Antenna& antenna);

/// Layers of a tile by a receiver::Receiver for each cell and draw: for whatever CellSolver does not fit
/// (signals with strength, weights by C/N0, RAIM, position filter, disturbances). Signals are those of
/// simulation::Environment::arrival() at each cell. Const, thread-safe.
///
/// Receivers have run for long (SignalLockOptions::warm_start) and are at rest. Draw d at a time has the same
/// seed at every cell, so that maps are smooth and do not depend on tiles. Values without noise are those of
/// draw 0 of a receiver without errors from space that states C/N0 without noise, whose satellites have no
/// constant of their own and no shadow by what the map lacks and an empty street, with the noise taken out of
/// its pseudoranges (its mean stays) and solved by positioning::solve_fix(): weights are what the receiver
/// believes. Availability of signals with strength is the share of draws that have a fix. Each draw has a
/// street of its own (ReceiverConfig::streets), as an antenna in one of its lanes sees it; its height over
/// the road is that over the terrain.
class CellReceivers {
 public:
  /// The environment and the propagator must outlive it. Throws InputError for options that do not
  /// validate().
  CellReceivers(const simulation::Environment& environment, const propagation::Propagator& propagator,
                const simulation::ReceiverConfig& receiver, const DrawOptions& draws,
                const LimitOptions& limits = {});

  /// As CellSolver::solve(), for the layers of_solver(); others are left alone.
  void solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
             std::span<const std::span<float>> layers) const;

  /// TimeToFirstFix: the receiver of each draw begins at `time` and observes once a second until it has a
  /// fix, satellites, paths and streets going on meanwhile. What it knows is LimitOptions::start; signals
  /// without strength are measured at once. Some hundred times slower than one look: 30 epochs, each traced.
  /// @param seconds one for each cell @param stop asked after each row of cells; true leaves the rest
  void first_fix(const TileCells& cells, geodesy::GpsTime time, std::span<float> seconds,
                 const std::function<bool()>& stop) const;

 private:
  /// One epoch of a receiver of its own. @param arrival a copy, for it is disturbed
  [[nodiscard]] receiver::ReceiverEpoch observe(const receiver::ReceiverOptions& options, int draw,
                                                std::span<const disturbance::Source> disturbances,
                                                const propagation::Antenna& antenna,
                                                propagation::Arrival arrival) const;
  void solve_without_noise(const propagation::Antenna& antenna, const propagation::Arrival& arrival,
                           CellValues& values) const;
  /// @param space of each draw, or empty
  void draw(const propagation::Antenna& antenna, const propagation::Arrival& arrival,
            std::span<const errors::SpaceErrors> space, bool statistics, CellValues& values) const;
  /// Those of draws at a place: a street of its own each, where the receiver has one.
  [[nodiscard]] std::vector<disturbance::Source> disturbances_at(const Eigen::Vector3d& place) const;
  [[nodiscard]] double first_fix_at(geodesy::GpsTime time, const Eigen::Vector3d& place,
                                    std::span<const errors::SpaceErrors> space) const;

  const simulation::Environment* environment_;
  const propagation::Propagator* propagator_;
  receiver::ReceiverOptions options_;
  std::vector<disturbance::Source> disturbances_;
  std::optional<disturbance::StreetsOptions> streets_;
  DrawOptions draws_;
  LimitOptions limits_;
};

}  // namespace canyon::heatmap
