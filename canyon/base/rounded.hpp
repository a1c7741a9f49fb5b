#pragma once

#include <cmath>

namespace canyon {

/// The shortest number within half a unit of the last of `decimals` digits, and never -0. Infinity and NaN
/// stay: JSON has null for them.
inline double rounded(double value, int decimals) {
  const double scale = std::pow(10.0, decimals);
  const double result = std::round(value * scale) / scale;
  return result == 0 ? 0.0 : result;
}

}  // namespace canyon
