#pragma once

#include <chrono>
#include <compare>
#include <cstdint>

namespace canyon::geodesy {

/// An instant on the GPS time scale, a whole number of nanoseconds since 1980-01-06 00:00:00 GPST.
/// Arithmetic in nanoseconds is exact; the range is 1687 to 2272. Times of other scales (UTC, BDT, GLONASST)
/// are converted on input and output, see time_scales.hpp. Doubles hold intervals in seconds, never instants.
class GpsTime {
 public:
  static constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;
  static constexpr std::int64_t kSecondsPerWeek = 604'800;
  static constexpr std::int64_t kNanosecondsPerWeek = kSecondsPerWeek * kNanosecondsPerSecond;

  /// 1980-01-06 00:00:00 GPST.
  constexpr GpsTime() = default;

  /// @param week full week number (not modulo 1024); may be negative
  /// @param seconds_of_week [s], rounded to the nearest nanosecond; values outside [0, 604800) carry over
  /// Throws InputError for a non-finite value or a result outside the years 1700 to 2260.
  [[nodiscard]] static GpsTime from_week(int week, double seconds_of_week);
  [[nodiscard]] static constexpr GpsTime from_nanoseconds(std::int64_t nanoseconds_since_1980) {
    GpsTime t;
    t.nanoseconds_ = nanoseconds_since_1980;
    return t;
  }

  [[nodiscard]] constexpr std::int64_t nanoseconds() const { return nanoseconds_; }
  /// Full week number, floor: -1 just before 1980-01-06.
  [[nodiscard]] constexpr int week() const {
    std::int64_t w = nanoseconds_ / kNanosecondsPerWeek;
    if (nanoseconds_ % kNanosecondsPerWeek < 0) --w;
    return static_cast<int>(w);
  }
  /// [0, 604800e9) ns, exact.
  [[nodiscard]] constexpr std::int64_t nanosecond_of_week() const {
    return nanoseconds_ - static_cast<std::int64_t>(week()) * kNanosecondsPerWeek;
  }
  /// [0, 604800) s; a double resolves 0.12 ns there.
  [[nodiscard]] constexpr double seconds_of_week() const {
    return static_cast<double>(nanosecond_of_week()) / 1e9;
  }

  friend constexpr auto operator<=>(GpsTime, GpsTime) = default;

  /// Seconds from b to a. Up to 104 days apart: the closest double (whole seconds are exact); beyond: within
  /// two roundings. Precondition: less than 292 years apart.
  friend constexpr double operator-(GpsTime a, GpsTime b) {
    return static_cast<double>(a.nanoseconds_ - b.nanoseconds_) / 1e9;
  }
  /// `seconds` rounded to the nearest nanosecond. Precondition: finite, within +-292 years.
  friend GpsTime operator+(GpsTime t, double seconds);
  friend GpsTime operator-(GpsTime t, double seconds) { return t + -seconds; }
  friend constexpr GpsTime operator+(GpsTime t, std::chrono::nanoseconds d) {
    return from_nanoseconds(t.nanoseconds_ + d.count());
  }
  friend constexpr GpsTime operator-(GpsTime t, std::chrono::nanoseconds d) {
    return from_nanoseconds(t.nanoseconds_ - d.count());
  }

 private:
  std::int64_t nanoseconds_ = 0;
};

/// The nearest multiple of `step_ns` > 0 since 1980-01-06; halves are rounded away from 1980-01-06.
[[nodiscard]] constexpr GpsTime round_to(GpsTime t, std::int64_t step_ns) {
  const std::int64_t half = t.nanoseconds() < 0 ? -(step_ns / 2) : step_ns / 2;
  return GpsTime::from_nanoseconds((t.nanoseconds() + half) / step_ns * step_ns);
}

}  // namespace canyon::geodesy
