#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/validation/statistics.hpp"

// Not public: of canyon/validation and canyon/calibration.

namespace canyon::validation {

/// Median interval of times in order [s]; 1 for fewer than two.
[[nodiscard]] inline double interval_of(std::span<const geodesy::GpsTime> times) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  return median(steps).value_or(1);
}

/// Epochs in a block of `seconds`, by the median interval of the times; at least 1, and at most a fifth of
/// them: of fewer blocks resamples would hardly differ, and look sure.
[[nodiscard]] inline std::size_t epochs_in(double seconds, std::span<const geodesy::GpsTime> times) {
  const double interval_s = interval_of(times);
  const double epochs = std::round(seconds / std::max(interval_s, 1e-3));
  const double most = std::floor(static_cast<double>(times.size()) / 5);
  return static_cast<std::size_t>(std::max(1.0, std::min(epochs, most)));
}

}  // namespace canyon::validation
