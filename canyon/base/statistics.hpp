#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace canyon {

/// Standard deviation over the median of magnitudes, of a normal distribution.
inline constexpr double kMadToSigma = 1.4826;

/// Value at rank p (n - 1) of the ordered values, counted from 0, linear between neighbours: definition 7 of
/// Hyndman and Fan (The American Statistician 50, 1996), NumPy's and R's default. Empty for no values.
/// @param values none is NaN
/// @param p in [0, 1] (asserted)
[[nodiscard]] std::optional<double> quantile(std::span<const double> values, double p);
/// The same at several `p`, which rise; empty for no values.
[[nodiscard]] std::vector<double> quantiles(std::span<const double> values, std::span<const double> p);
/// The same without a copy, for hot loops: reorders `values`, of which there is at least one.
/// @param ranked values before this index are at their rank already; moves on to that of the quantile, so
/// that the next one, of a larger p, has less to do. 0 at first.
[[nodiscard]] double select_quantile(std::span<double> values, double p, std::size_t& ranked);
/// quantile(values, 0.5).
[[nodiscard]] std::optional<double> median(std::span<const double> values);

}  // namespace canyon
