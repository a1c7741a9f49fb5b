#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "canyon/base/statistics.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/heatmap/cells/cell_solver.hpp"
#include "canyon/positioning/protection_level.hpp"

namespace canyon::heatmap {

/// All layers of one cell, NaN until set.
struct CellValues {
  std::array<float, kLayerCount> of{};

  CellValues() { of.fill(std::numeric_limits<float>::quiet_NaN()); }
  void set(Layer layer, double value) { of[static_cast<std::size_t>(layer)] = static_cast<float>(value); }
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

/// Fixes of a cell's draws.
struct DrawnFixes {
  std::vector<double> horizontal_m, vertical_m;  ///< errors, the vertical ones without sign
  std::vector<double> protection_m;              ///< protection levels

  void add(const Eigen::Vector3d& error_enu_m, const Eigen::Matrix3d& covariance_enu,
           const LimitOptions& limits) {
    horizontal_m.push_back(error_enu_m.head<2>().norm());
    vertical_m.push_back(std::abs(error_enu_m.z()));
    protection_m.push_back(
        positioning::horizontal_protection_level_m(covariance_enu, limits.protection_factor));
  }
  /// Sets all layers over draws but TimeToFirstFix; reorders the errors. @param draws those without a fix too
  void describe(const LimitOptions& limits, int draws, CellValues& values, bool horizontal_quantiles = true,
                bool vertical_quantiles = true) {
    const auto fixes = static_cast<double>(horizontal_m.size());
    int beyond = 0, misled = 0, is_protected = 0;
    for (std::size_t i = 0; i < horizontal_m.size(); ++i) {
      beyond += horizontal_m[i] > limits.error_m;
      misled += horizontal_m[i] > protection_m[i];
      is_protected += protection_m[i] <= limits.alert_m;
    }
    values.set(Layer::ProtectedAvailability, static_cast<double>(is_protected) / draws);
    if (horizontal_m.empty()) return;
    values.set(Layer::HorizontalErrorExceedance, beyond / fixes);
    values.set(Layer::MisleadingShare, misled / fixes);
    values.describe(Layer::HorizontalErrorMean, horizontal_m, horizontal_quantiles);
    values.describe(Layer::VerticalErrorMean, vertical_m, vertical_quantiles);
  }
};

/// Seed of the receiver of one draw at a time: the same at all cells.
[[nodiscard]] std::uint64_t seed_of(const DrawOptions& draws, geodesy::GpsTime time, int draw);

}  // namespace canyon::heatmap
