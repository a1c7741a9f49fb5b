#pragma once

#include <algorithm>
#include <cassert>
#include <span>

#include "canyon/base/statistics.hpp"

namespace canyon {

/// Value that the next one of a sample is below with probability p: at rank p (n + 1) of the n ordered
/// values, linear between neighbours (definition 6 of Hyndman and Fan, The American Statistician 50, 1996).
/// Beyond 1 / (n + 1) from either end it is the smallest or the largest value: 90 % intervals need 19 values.
/// @param values two or more (asserted), none is NaN; @param p in [0, 1]
[[nodiscard]] inline double predictive_quantile(std::span<const double> values, double p) {
  assert(values.size() > 1);
  const auto n = static_cast<double>(values.size());
  return *quantile(values, std::clamp((p * (n + 1) - 1) / (n - 1), 0.0, 1.0));
}

}  // namespace canyon
