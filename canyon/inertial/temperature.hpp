#pragma once

#include <algorithm>
#include <cmath>

namespace canyon::inertial {

inline constexpr double kZeroCelsius_k = 273.15;
/// The temperature at which sensors are calibrated: errors by temperature are zero there.
inline constexpr double kCalibrated_k = kZeroCelsius_k + 25;

/// How much warmer than the air a sensor is at `t_s` since it was turned on: w (1 - exp(-t / T)).
/// @param final_k w; @param time_constant_s T, above 0
[[nodiscard]] inline double warming_k(double final_k, double time_constant_s, double t_s) {
  return -final_k * std::expm1(-std::max(t_s, 0.0) / time_constant_s);
}

}  // namespace canyon::inertial
