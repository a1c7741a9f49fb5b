#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

namespace canyon::output {

/// Quantile with linear interpolation between order statistics: value at rank p (n - 1), counted from 0
/// (Hyndman and Fan 1996, definition 7; NumPy's and R's default). `p` in [0, 1]; NaN for no values.
[[nodiscard]] double percentile(std::vector<double> values, double p);

/// Characters that a UTF-8 text takes on a terminal, one column each.
[[nodiscard]] std::size_t display_width(std::string_view utf8);

}  // namespace canyon::output
