#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "canyon/base/options/fwd.hpp"
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
  SteadyState,  ///< of their loops and fix, computed without running them (SteadyReceivers), where that fits
  Run,          ///< each is run (CellReceivers): some hundred times slower, and the reference of the other
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

}  // namespace canyon::heatmap
