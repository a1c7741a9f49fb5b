#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "canyon/base/statistics.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/heatmap/engine/cell_solver.hpp"

namespace canyon::heatmap {

/// All layers of one cell, NaN until set.
struct CellValues {
  std::array<float, static_cast<std::size_t>(Layer::SkyView) + 1> of{};

  CellValues() { of.fill(std::numeric_limits<float>::quiet_NaN()); }
  void set(Layer layer, double value) { of[static_cast<std::size_t>(layer)] = static_cast<float>(value); }
  /// Mean, RMS, median and 95th percentile, in this order from `mean` on.
  void describe(Layer mean, std::vector<double>& errors) {
    if (errors.empty()) return;
    std::sort(errors.begin(), errors.end());
    double sum = 0, squares = 0;
    for (const double error : errors) {
      sum += error;
      squares += error * error;
    }
    const auto count = static_cast<double>(errors.size());
    const auto first = static_cast<std::size_t>(mean);
    of[first] = static_cast<float>(sum / count);
    of[first + 1] = static_cast<float>(std::sqrt(squares / count));
    of[first + 2] = static_cast<float>(*quantile(errors, 0.5));
    of[first + 3] = static_cast<float>(*quantile(errors, 0.95));
  }
};

/// Seed of the receiver of one draw at a time: the same at all cells.
[[nodiscard]] std::uint64_t seed_of(const DrawOptions& draws, geodesy::GpsTime time, int draw);

}  // namespace canyon::heatmap
