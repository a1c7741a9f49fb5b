#include "canyon/base/statistics.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace canyon {

double select_quantile(std::span<double> values, double p, std::size_t& ranked) {
  assert(!values.empty() && p >= 0 && p <= 1);
  const double rank = p * static_cast<double>(values.size() - 1);
  const auto from = values.begin() + static_cast<std::ptrdiff_t>(ranked);
  ranked = static_cast<std::size_t>(rank);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(ranked);
  std::nth_element(from, at, values.end());
  const double part = rank - std::floor(rank);
  if (part == 0) return *at;
  return *at + part * (*std::min_element(at + 1, values.end()) - *at);
}

std::vector<double> quantiles(std::span<const double> values, std::span<const double> p) {
  assert(std::is_sorted(p.begin(), p.end()));
  std::vector<double> result;
  if (values.empty()) return result;
  std::vector<double> copy(values.begin(), values.end());
  std::size_t ranked = 0;
  for (const double each : p) result.push_back(select_quantile(copy, each, ranked));
  return result;
}

std::optional<double> quantile(std::span<const double> values, double p) {
  const std::vector<double> result = quantiles(values, {&p, 1});
  if (result.empty()) return std::nullopt;
  return result.front();
}

std::optional<double> median(std::span<const double> values) {
  return quantile(values, 0.5);
}

}  // namespace canyon
