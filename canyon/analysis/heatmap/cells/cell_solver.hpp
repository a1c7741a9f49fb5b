#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "canyon/analysis/heatmap/kernels/layers.hpp"
#include "canyon/analysis/heatmap/kernels/tile_tracer.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/receiver/positioning/positioning_options.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::heatmap {

struct MonteCarloOptions {
  int samples = 64;        ///< noise realizations for the layers over realizations; [1, 10,000]
  std::uint64_t seed = 1;  ///< same realizations at every cell (common random numbers): smooth maps
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, MonteCarloOptions& o);

/// Computation of receivers whose signals have strength.
enum class ReceiverModel : std::uint8_t {
  SteadyState,  ///< steady state of loops and fix, computed without running them (CellMethod::Steady), if
                ///< possible
  Run,  ///< each receiver is run (CellMethod::Run): some hundred times slower, the reference of SteadyState
};
struct CellReceiverOptions {
  ReceiverModel model = ReceiverModel::SteadyState;
  /// SteadyState: distance of the points at which paths are searched [m]; paths at the cells between are
  /// constructed from them; [0, 100]. 0: searched at every cell.
  double path_nodes_m = 6;
  [[nodiscard]] bool operator==(const CellReceiverOptions&) const = default;
};
void visit(options::Visitor& v, CellReceiverOptions& o);

/// How the cells of a map are computed, fastest first.
enum class CellMethod : std::uint8_t {
  /// Geometry alone, for receivers whose signals have no strength: cells that receive the same satellites
  /// have one common fix (solve_shared()).
  Shared,
  /// The steady state of loops and fix, without the transient: the same realizations as receivers that are
  /// run, the same strengths and random phases of paths, the loops' points of rest (tracking::BatchCodeLock),
  /// the fix linearised at the true position (CellFix). Paths are traced at one cell of each block of cells
  /// (a node) and constructed from it at the cells around it (Propagator::trace_first_order()); paths that no
  /// node near a cell has are missed there; diffuse paths are those of the block's node. Errors:
  /// docs/heatmap.md.
  Steady,
  /// A receiver::Receiver for each cell and realization (ReceiverRealizations). Values without noise are
  /// those of realization 0 of a receiver without range errors (satellite, atmosphere), with C/N0 reported
  /// without noise, without per-satellite constants, unmapped shadows and traffic. The noise is removed from
  /// its pseudoranges (its mean stays), which are solved by positioning::solve_fix() with the receiver's own
  /// weights. Availability of signals with strength is the fraction of realizations that have a fix.
  ///
  /// Layers of RTK: the receiver of each realization is stationary, has tracked for long
  /// (SignalLockOptions::warm_start) and has all ephemerides. From the time of the map on it measures once a
  /// second, with the corrections of a base, for LimitOptions::rtk_s. Satellites and paths move meanwhile.
  /// The base measures the same sky: its realization d and that of every cell have the same range errors.
  /// Corrections arrive as set in rtk::CorrectionOptions. Const, thread-safe. Some thousand times slower
  /// than a single epoch: each second is traced, and each realization has its own filter.
  Run,
};

/// The fastest method that computes the fix of this receiver.
[[nodiscard]] CellMethod cell_method(const simulation::ReceiverConfig& receiver);

/// A receiver that moves through cells.
struct Movement {
  simulation::MapOptions how;                 ///< Driving or Flying
  positioning::PositionFilterOptions filter;  ///< enabled
};
/// The receiver of a map and how its cells are computed.
struct CellReceiver {
  const simulation::ReceiverConfig& config;
  const simulation::ReceiverConfig* base = nullptr;  ///< at a fixed position, settled, for layers of RTK
  MonteCarloOptions samples;
  CellReceiverOptions how;
  LimitOptions limits;
  std::optional<Movement> movement;  ///< of Steady; empty: it is stationary in each cell
};

/// Computes layers of a tile's cells at one time. Each kind of solver computes a part of a receiver, without
/// effects that cell_method() shows to be unnecessary. Directions are those of the tile's centre, except in
/// running receivers. Work is distributed over the calling task arena's threads. Values do not depend on the
/// threads, nor on the tiles of a grid except for the directions. Const, thread-safe.
///
/// Layers over realizations count those with a fix. Quantiles are definition 7 of Hyndman and Fan (The
/// American Statistician 50, 1996). Vertical is along the ellipsoid's normal.
class CellSolver {
 public:
  virtual ~CellSolver() = default;
  /// layers[k] has one float for each cell, of wanted[k]. Layers of other solvers are not changed; in the
  /// solver's own, cells that are not Computed are NaN.
  /// @param stop polled by slow solvers; true ends the work
  /// @returns false: stopped, cells are missing
  [[nodiscard]] virtual bool solve(const TileCells& cells, geodesy::GpsTime time,
                                   std::span<const Layer> wanted, std::span<const std::span<float>> layers,
                                   const std::function<bool()>& stop) const = 0;

 protected:
  CellSolver() = default;
  CellSolver(const CellSolver&) = default;
  CellSolver& operator=(const CellSolver&) = default;
};

/// The solver of a method, for the layers is_solver_layer(). Shared accepts any receiver if only line of
/// sight is requested. Environment, tracer and the receiver's configs must outlive it. Throws InputError for
/// options that do not validate().
[[nodiscard]] std::unique_ptr<const CellSolver> cell_solver(CellMethod method,
                                                            const simulation::Environment& environment,
                                                            const TileTracer& tracer,
                                                            const CellReceiver& receiver);
/// Solvers that together compute the layers except SkyView. Throws likewise, and for too many base epochs.
[[nodiscard]] std::vector<std::unique_ptr<const CellSolver>> cell_solvers(
    const simulation::Environment& environment, const TileTracer& tracer, const CellReceiver& receiver,
    std::span<const Layer> layers);

}  // namespace canyon::heatmap
