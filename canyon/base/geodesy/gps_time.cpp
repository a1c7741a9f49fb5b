#include "canyon/base/geodesy/gps_time.hpp"

#include <cassert>
#include <cmath>

#include "canyon/base/input_error.hpp"

namespace canyon::geodesy {

GpsTime GpsTime::from_week(int week, double seconds_of_week) {
  // Limits the time to some 280 years before and after 1980, so that arithmetic by decades cannot overflow.
  constexpr int kMaxWeek = 14'600;
  // The condition is negated to reject NaN.
  const double weeks = week + seconds_of_week / kSecondsPerWeek;
  if (!(std::abs(weeks) <= kMaxWeek) || std::abs(static_cast<double>(week)) > 2 * kMaxWeek) {
    throw InputError("GPS time of week " + std::to_string(week) + ", " + std::to_string(seconds_of_week) +
                         " s is out of range",
                     "weeks count from 1980-01-06, seconds of the week run from 0 to 604800");
  }
  // Adds whole seconds and the fraction separately: 604799.123456789 as one double would lose tenths of ns.
  const double whole = std::floor(seconds_of_week);
  const double fraction = seconds_of_week - whole;
  // Sums in seconds first, because week and seconds may be large with opposite signs.
  return from_nanoseconds((week * kSecondsPerWeek + static_cast<std::int64_t>(whole)) *
                              kNanosecondsPerSecond +
                          std::llround(fraction * 1e9));
}

GpsTime operator+(GpsTime t, double seconds) {
  assert(std::isfinite(seconds));
  const double whole = std::floor(seconds);
  const double fraction = seconds - whole;
  return GpsTime::from_nanoseconds(t.nanoseconds_ +
                                   static_cast<std::int64_t>(whole) * GpsTime::kNanosecondsPerSecond +
                                   std::llround(fraction * 1e9));
}

}  // namespace canyon::geodesy
