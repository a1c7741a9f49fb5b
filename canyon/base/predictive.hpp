#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace canyon {

/// Fewest values whose 90 % interval does not end at the smallest and the largest one.
inline constexpr std::size_t kFewestOf90 = 19;

/// Value that the next one of a sample is below with probability p: at rank p (n + 1) of the n ordered
/// values, linear between neighbours (definition 6 of Hyndman and Fan, The American Statistician 50, 1996).
/// Beyond 1 / (n + 1) from either end it is the smallest or the largest value: 90 % intervals need
/// kFewestOf90.
/// @param values one or more (asserted), none is NaN; @param p in [0, 1]
[[nodiscard]] double predictive_quantile(std::span<const double> values, double p);

/// What 90 % intervals of fewer than kFewestOf90 values are: they hold the next one with (n - 1) / (n + 1).
/// Empty from kFewestOf90 on. @param count 1 or more; @param noun of the values, such as "draws"
[[nodiscard]] std::optional<std::string> caution_of_few(std::size_t count, std::string_view noun);

}  // namespace canyon
