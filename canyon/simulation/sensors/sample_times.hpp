#pragma once

#include <cmath>
#include <cstdint>

namespace canyon::simulation {

/// The end of the interval of a sensor's sample `k` since the begin of the run [s]; samples count from 1. In
/// whole nanoseconds, as all instants. @param rate_hz > 0
[[nodiscard]] inline double sample_end_s(std::int64_t k, double rate_hz) {
  return std::round(static_cast<double>(k) / rate_hz * 1e9) / 1e9;
}

/// The number of samples whose intervals have ended `since_begin_s` after the begin of the run.
[[nodiscard]] inline std::int64_t samples_until(double since_begin_s, double rate_hz) {
  constexpr double kNanosecond = 1e-9;
  return static_cast<std::int64_t>(std::floor((since_begin_s + kNanosecond) * rate_hz));
}

}  // namespace canyon::simulation
