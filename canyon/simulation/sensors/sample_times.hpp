#pragma once

#include <cmath>
#include <cstdint>

namespace canyon::simulation {

/// The end of the interval of a sensor's sample `k` since the begin of the run [s]; samples count from 1. In
/// whole nanoseconds, as all instants. @param rate_hz > 0
[[nodiscard]] inline double sample_end_s(std::int64_t k, double rate_hz) {
  return std::round(static_cast<double>(k) / rate_hz * 1e9) / 1e9;
}

}  // namespace canyon::simulation
