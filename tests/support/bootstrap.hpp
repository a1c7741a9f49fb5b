#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "canyon/analysis/validation/statistics.hpp"
#include "canyon/base/random.hpp"

// The bootstrap by its definition, one resample after the other: the reference for the intervals of metrics.

namespace canyon::test {

struct BootstrapOptions {
  int resamples = 2000;
  double confidence = 0.95;  ///< (0, 1)
  /// Block length of the circular block bootstrap (Politis and Romano 1992): the number of correlated
  /// observations.
  std::size_t block = 1;
  std::uint64_t seed = 1;
};

/// Percentile interval (Efron and Tibshirani, An Introduction to the Bootstrap, 1993, 13.3) of a statistic of
/// n observations in order. `statistic` gets n indices in [0, n), with repeats; resamples for which it is
/// empty are ignored. Same seed, same interval. Empty if n is 0 or half of the resamples or more have no
/// value.
inline std::optional<validation::Interval> bootstrap_interval(
    std::size_t n, const std::function<std::optional<double>(std::span<const std::size_t>)>& statistic,
    const BootstrapOptions& options = {}) {
  if (n == 0) return std::nullopt;
  const std::size_t block = std::min(options.block, n);
  RandomStream random(options.seed, "bootstrap");
  std::vector<std::size_t> sampled(n);
  std::vector<double> values;
  for (int r = 0; r < options.resamples; ++r) {
    for (std::size_t i = 0; i < n;) {
      auto at = static_cast<std::size_t>(random.uniform() * static_cast<double>(n));
      for (std::size_t k = 0; k < block && i < n; ++k, ++i) {
        sampled[i] = at;
        at = at + 1 < n ? at + 1 : 0;
      }
    }
    if (const auto value = statistic(sampled)) values.push_back(*value);
  }
  if (2 * values.size() <= static_cast<std::size_t>(options.resamples)) return std::nullopt;
  const double tail = (1 - options.confidence) / 2;
  const std::vector<double> ends = quantiles(values, std::array{tail, 1 - tail});
  return validation::Interval{ends[0], ends[1]};
}

}  // namespace canyon::test
