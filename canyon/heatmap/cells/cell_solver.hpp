#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "canyon/gnss/navigation_data.hpp"
#include "canyon/heatmap/kernels/layers.hpp"
#include "canyon/heatmap/kernels/tile_tracer.hpp"
#include "canyon/receiver/receiver.hpp"

namespace canyon::heatmap {

struct DrawOptions {
  int draws = 64;          ///< of noise, for the layers over draws; [1, 10,000]
  std::uint64_t seed = 1;  ///< the same draws at every cell (common random numbers), so that maps are smooth
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
/// Its fields.
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
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
/// Its fields.
void visit(options::Visitor& v, CellReceiverOptions& o);

/// Layers of a tile from its signals. Cells that receive the same satellites share one solution matrix: with
/// directions H of the used satellites and their weights W, the error of a fix is
///   dx = K m,  K = (H^T W H)^-1 H^T W
/// (Misra and Enge, Global Positioning System, 2nd ed. 2011, section 6.1), m the pseudorange errors; then
/// what is not linear, until it converges: the curvature of the ranges and of H, the Earth's turning,
/// weights and atmosphere that follow the place found. Same answers as positioning::solve_fix() within 1 mm
/// for errors below 1 km and PDOP below 100, weights by elevation below 300 m; DOPs within 1e-3 of
/// themselves. Cells where one of its rules may go either way (mask, PDOP limit) and those that do not
/// converge are solved by positioning::solve_fix() itself. Const, thread-safe.
///
/// Errors of pseudoranges are excess, the noise's mean, and the atmosphere in the signal less what the fix
/// takes off. Noise is drawn from the stationary distribution of each satellite's process, drifting mean
/// included (the cell's receiver is at rest), by a stream of its own for each satellite and time: values do
/// not depend on how a grid is cut into tiles, but for the directions, which are those of a tile's centre.
/// The effect of noise on the curvature of H and on weights is left out (1e-4 of it for an error of 1 km,
/// weights by elevation 1e-2).
///
/// Layers over draws are over those draws that have a fix. Quantiles are definition 7 of Hyndman and Fan (The
/// American Statistician 50, 1996). Vertical is along the ellipsoid's normal at the cell.
class CellSolver {
 public:
  /// Shared solutions converge. So does a receiver's iteration within these bounds: the last change, times
  /// what a metre changes in the atmosphere (6e-3 at 3 deg) and PDOP 100, is below 1 mm.
  static constexpr int kIterations = 20;          ///< at least
  static constexpr double kConvergence_m = 1e-3;  ///< at most

  /// For receivers that CellMethod::Shared fits.
  /// @param klobuchar per system, GPS's as fallback; needed where an ionosphere is in the signal or corrected
  /// Throws InputError for bad options, a receiver that does not fit and missing Klobuchar coefficients.
  CellSolver(const receiver::ReceiverOptions& receiver, const DrawOptions& draws,
             const std::map<gnss::System, gnss::Klobuchar>& klobuchar = {}, const LimitOptions& limits = {});
  ~CellSolver();
  CellSolver(CellSolver&&) noexcept;
  CellSolver& operator=(CellSolver&&) noexcept;

  /// layers[k] has one float for each cell, of wanted[k] (SkyView and TimeToFirstFix: left alone); NaN in
  /// cells that are not Computed. Protection levels are those of the weights alone: receivers that scale by
  /// their residuals (FixOptions::covariance_by_residuals) are not for these.
  /// @param signals of at most 128 satellites, else InputError. Excess is needed for errors (asserted);
  /// without it LargestExcess is NaN, and DOPs, counts and availability are those of a receiver that finds
  /// itself at the cell (which matters for a satellite at the very mask alone).
  void solve(const TileCells& cells, const TileSignals& signals, std::span<const Layer> wanted,
             std::span<const std::span<float>> layers) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::heatmap
