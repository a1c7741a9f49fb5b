#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "canyon/analysis/heatmap/cells/cell_solver.hpp"
#include "canyon/analysis/heatmap/kernels/tile_tasks.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/receiver/positioning/least_squares.hpp"

namespace canyon::heatmap {

/// All layers of one cell, NaN until set.
struct CellValues {
  std::array<float, kLayerCount> of{};

  CellValues() { of.fill(std::numeric_limits<float>::quiet_NaN()); }
  void set(Layer layer, double value) { of[static_cast<std::size_t>(layer)] = static_cast<float>(value); }
  /// @param nlos of the tracked ones, without a direct path @param largest_excess_m empty: not known
  void set_satellites(int los, int visible, int blocked, int nlos, std::optional<double> largest_excess_m) {
    set(Layer::SatellitesLos, los);
    set(Layer::SatellitesVisible, visible);
    set(Layer::SatellitesBlocked, blocked);
    if (visible == 0) return;
    set(Layer::NlosFraction, static_cast<double>(nlos) / visible);
    if (largest_excess_m) set(Layer::LargestExcess, *largest_excess_m);
  }
  /// The fix without noise.
  void set_fix(const Eigen::Vector3d& error_enu_m, const std::optional<positioning::Dop>& dop,
               double protection_m) {
    set(Layer::HorizontalError, error_enu_m.head<2>().norm());
    set(Layer::VerticalError, error_enu_m.z());
    if (dop) {
      set(Layer::Hdop, dop->hdop);
      set(Layer::Pdop, dop->pdop);
      set(Layer::Vdop, dop->vdop);
    }
    set(Layer::ProtectionLevel, protection_m);
  }
  /// Writes the wanted layers for which Mine() is true to a cell; other layers are not changed.
  template <bool (*Mine)(Layer) = is_solver_layer>
  void store(std::span<const Layer> wanted, std::span<const std::span<float>> layers,
             std::size_t cell) const {
    for (std::size_t k = 0; k < wanted.size(); ++k)
      if (Mine(wanted[k])) layers[k][cell] = of[static_cast<std::size_t>(wanted[k])];
  }
  /// Mean, RMS, median and 95th percentile, in this order from `mean` on. @param errors reordered
  void describe(Layer mean, std::vector<double>& errors, bool quantiles) {
    if (errors.empty()) return;
    double sum = 0, squares = 0;
    for (const double error : errors) {
      sum += error;
      squares += error * error;
    }
    const auto count = static_cast<double>(errors.size());
    const auto first = static_cast<std::size_t>(mean);
    of[first] = static_cast<float>(sum / count);
    of[first + 1] = static_cast<float>(std::sqrt(squares / count));
    if (!quantiles) return;
    std::size_t ranked = 0;
    of[first + 2] = static_cast<float>(select_quantile(errors, 0.5, ranked));
    of[first + 3] = static_cast<float>(select_quantile(errors, 0.95, ranked));
  }
};

/// Fixes of a cell's realizations.
struct SampledFixes {
  std::vector<double> horizontal_m, vertical_m;  ///< errors, the vertical ones without sign
  std::vector<double> protection_m;              ///< protection levels

  void add(const Eigen::Vector3d& error_enu_m, const Eigen::Matrix3d& covariance_enu,
           const LimitOptions& limits) {
    horizontal_m.push_back(error_enu_m.head<2>().norm());
    vertical_m.push_back(std::abs(error_enu_m.z()));
    protection_m.push_back(
        positioning::horizontal_protection_level_m(covariance_enu, limits.protection_factor));
  }
  /// Sets all layers over realizations; reorders the errors. @param sample_count also those without a fix
  void describe(const LimitOptions& limits, int sample_count, CellValues& values,
                bool horizontal_quantiles = true, bool vertical_quantiles = true) {
    const auto fixes = static_cast<double>(horizontal_m.size());
    int beyond = 0, misled = 0, is_protected = 0;
    for (std::size_t i = 0; i < horizontal_m.size(); ++i) {
      beyond += horizontal_m[i] > limits.error_m;
      misled += horizontal_m[i] > protection_m[i];
      is_protected += protection_m[i] <= limits.alert_m;
    }
    values.set(Layer::ProtectedAvailability, static_cast<double>(is_protected) / sample_count);
    if (horizontal_m.empty()) return;
    values.set(Layer::HorizontalErrorExceedance, beyond / fixes);
    values.set(Layer::MisleadingFraction, misled / fixes);
    values.describe(Layer::HorizontalErrorMean, horizontal_m, horizontal_quantiles);
    values.describe(Layer::VerticalErrorMean, vertical_m, vertical_quantiles);
  }
};

/// Layers of a solver that need more than the line of sight.
[[nodiscard]] inline bool needs_signals(Layer layer) {
  return info(layer).received && is_solver_layer(layer);
}
/// The layers over realizations.
[[nodiscard]] inline bool is_sample_layer(Layer layer) {
  return info(layer).needs_samples && is_solver_layer(layer);
}

/// Fills the layers Mine() of a tile, each row a task; solve_cell(place, values) computes those of a cell.
/// @param stop called before each row; empty: never @returns false: stopped
template <bool (*Mine)(Layer), class SolveCell>
bool solve_rows(const TileCells& cells, std::span<const Layer> wanted,
                std::span<const std::span<float>> layers, const std::function<bool()>& stop,
                const SolveCell& solve_cell) {
  spread(cells.tile.rows, [&](std::size_t row) {
    if (stop && stop()) return;
    for (std::size_t i = row * cells.tile.columns; i < (row + 1) * cells.tile.columns; ++i) {
      CellValues values;
      if (cells.state[i] == CellState::Computed) solve_cell(cells.centre(i), values);
      values.store<Mine>(wanted, layers, i);
    }
  });
  return !stop || !stop();
}

}  // namespace canyon::heatmap
