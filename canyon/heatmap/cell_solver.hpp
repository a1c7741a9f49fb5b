#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "canyon/heatmap/layers.hpp"
#include "canyon/heatmap/signals.hpp"
#include "canyon/receiver/receiver.hpp"

namespace canyon::heatmap {

struct DrawOptions {
  int draws = 64;          ///< of noise, for the layers over draws; [1, 10,000]
  std::uint64_t seed = 1;  ///< the same draws at every cell (common random numbers), so that maps are smooth
  /// Throws InputError naming the field and its bound.
  void validate() const;
};

/// Layers of a tile from its signals. Cells that receive the same satellites share one solution matrix: with
/// directions H of the used satellites and their weights W, the error of a fix is
///   dx = K m,  K = (H^T W H)^-1 H^T W,
/// m the pseudorange errors; then one more Newton step for the ranges' curvature, |dx_perp|^2 / (2 r). Same
/// answers as receiver::solve_fix() (rules for constellations, minimum of satellites, masks included) within
/// 1 mm for errors below 1 km and PDOP below 100. Const, thread-safe.
class CellSolver {
 public:
  /// For receivers whose signals have no strength (SignalOptions::enabled off), with Sigma, Equal or
  /// Elevation weights and without RAIM or position filter: see fits().
  CellSolver(const receiver::ReceiverOptions& receiver, const DrawOptions& draws);
  ~CellSolver();
  CellSolver(CellSolver&&) noexcept;
  [[nodiscard]] static bool fits(const receiver::ReceiverOptions& receiver);

  /// layers[k] has one float for each cell, of wanted[k] (SkyView: left alone); NaN in cells that are not
  /// Computed.
  void solve(const TileCells& cells, const TileSignals& signals, std::span<const Layer> wanted,
             std::span<const std::span<float>> layers) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::heatmap
