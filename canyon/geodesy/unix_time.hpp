#pragma once

#include <cstdint>

#include "canyon/geodesy/time_scales.hpp"

namespace canyon::geodesy {

/// GPS time 0, 1980-01-06 00:00:00 UTC, in POSIX time [s].
inline constexpr std::int64_t kGpsEpochUnix_s = 315'964'800;

/// POSIX time [ns] of an instant, which counts no leap seconds. gps_from_unix() is its inverse.
[[nodiscard]] inline std::int64_t unix_from_gps(GpsTime t) {
  return t.nanoseconds() + (kGpsEpochUnix_s - leap_seconds(t)) * GpsTime::kNanosecondsPerSecond;
}

}  // namespace canyon::geodesy
