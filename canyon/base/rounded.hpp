#pragma once

#include <cmath>

namespace canyon {

/// The shortest number within half a unit of the last of `decimals` digits, and never -0. What is not finite
/// stays so: JSON has null for it.
inline double rounded(double value, int decimals) {
  const double scale = std::pow(10.0, decimals);
  const double result = std::round(value * scale) / scale;
  return result == 0 ? 0.0 : result;
}

}  // namespace canyon
