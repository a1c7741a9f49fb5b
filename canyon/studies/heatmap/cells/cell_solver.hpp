#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "canyon/base/options/fwd.hpp"
#include "canyon/receiver/positioning/positioning_options.hpp"
#include "canyon/run/environment.hpp"
#include "canyon/run/scenario/scenario.hpp"
#include "canyon/studies/heatmap/kernels/layers.hpp"
#include "canyon/studies/heatmap/kernels/tile_tracer.hpp"

namespace canyon::heatmap {

struct DrawOptions {
  int draws = 64;          ///< of noise, for the layers over draws; [1, 10,000]
  std::uint64_t seed = 1;  ///< the same draws at every cell (common random numbers), so that maps are smooth
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
/// Visits its fields.
void visit(options::Visitor& v, DrawOptions& o);

/// Computation of receivers whose signals have strength.
enum class ReceiverModel : std::uint8_t {
  SteadyState,  ///< of their loops and fix, computed without running them (CellMethod::Steady), where that
                ///< fits
  Run,          ///< each is run (CellMethod::Run): some hundred times slower, and the reference of the other
};
struct CellReceiverOptions {
  ReceiverModel model = ReceiverModel::SteadyState;
  /// SteadyState: paths are searched at places so far apart [m], and constructed anew at the cells between;
  /// [0, 100]. 0: searched at every cell.
  double path_nodes_m = 6;
  [[nodiscard]] bool operator==(const CellReceiverOptions&) const = default;
};
/// Visits its fields.
void visit(options::Visitor& v, CellReceiverOptions& o);

/// How the cells of a map are computed, fastest first.
enum class CellMethod : std::uint8_t {
  /// Geometry alone, for receivers whose signals have no strength: cells that receive the same satellites
  /// share one fix (solve_shared()).
  Shared,
  /// The state of loops and fix at rest, without the time until they rest: the same draws as Run, the same
  /// paths' strengths and random phases, loops where they rest (tracking::LaneCodeLock), the fix linear about
  /// the place (CellFix). Paths are traced at one cell of each block of cells (a node) and constructed anew
  /// at the cells about it (Propagator::trace_near()): paths that no node about a cell has are missed there;
  /// diffuse paths are those of the block's node. docs/heatmap.md states what that costs.
  Steady,
  /// A receiver::Receiver for each cell and draw (ReceiverDraws). Values without noise are those of draw 0 of
  /// a receiver without errors from space that states C/N0 without noise, whose satellites have no constant
  /// of their own and no shadow by what the map lacks and an empty street, with the noise taken out of its
  /// pseudoranges (its mean stays) and solved by positioning::solve_fix(): weights are what the receiver
  /// believes. Availability of signals with strength is the share of draws that have a fix.
  ///
  /// Layers of RTK: the receiver of each draw stands still, has tracked for long
  /// (SignalLockOptions::warm_start) and knows all ephemerides. From the time of the map on it measures once
  /// a second, with the corrections of a base, for LimitOptions::rtk_s. Satellites and paths move meanwhile.
  /// The base measures the same sky: draw d of it and of every cell has the same errors from space.
  /// Corrections come as relative::CorrectionOptions say. Const, thread-safe.  Some thousand times slower
  /// than one look: each second is traced, and each draw has a filter of its own.
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
  const simulation::ReceiverConfig* base = nullptr;  ///< at a fixed place, settled, for layers of RTK
  DrawOptions draws;
  CellReceiverOptions how;
  LimitOptions limits;
  std::optional<Movement> movement;  ///< of Steady; empty: it stands in each cell
};

/// Gives layers of a tile's cells at one time. Each kind computes a part of a receiver and leaves out what
/// cell_method() says that the receiver's cells do not need. Directions are those of the tile's centre but
/// where receivers run. Work is spread over the calling task arena's threads; values do not depend on them,
/// nor on how a grid is cut into tiles, but for the directions. Const, thread-safe.
///
/// Layers over draws are over those draws that have a fix. Quantiles are definition 7 of Hyndman and Fan (The
/// American Statistician 50, 1996). Vertical is along the ellipsoid's normal.
class CellSolver {
 public:
  virtual ~CellSolver() = default;
  /// layers[k] has one float for each cell, of wanted[k]. Those that the solver does not give are left alone;
  /// of the others, cells that are not Computed are NaN.
  /// @param stop asked by slow solvers; true leaves the rest
  /// @returns false: stopped, cells are missing
  [[nodiscard]] virtual bool solve(const TileCells& cells, geodesy::GpsTime time,
                                   std::span<const Layer> wanted, std::span<const std::span<float>> layers,
                                   const std::function<bool()>& stop) const = 0;

 protected:
  CellSolver() = default;
  CellSolver(const CellSolver&) = default;
  CellSolver& operator=(const CellSolver&) = default;
};

/// The solver of a method, of the layers of_solver(). For Shared any receiver will do where line of sight
/// alone is asked for. Environment, tracer and the receiver's configs must outlive it. Throws InputError for
/// options that do not validate().
[[nodiscard]] std::unique_ptr<const CellSolver> cell_solver(CellMethod method,
                                                            const simulation::Environment& environment,
                                                            const TileTracer& tracer,
                                                            const CellReceiver& receiver);
/// Solvers that give the layers together, but for SkyView. Likewise; throws InputError for too many epochs of
/// a base too.
[[nodiscard]] std::vector<std::unique_ptr<const CellSolver>> cell_solvers(
    const simulation::Environment& environment, const TileTracer& tracer, const CellReceiver& receiver,
    std::span<const Layer> layers);

}  // namespace canyon::heatmap
