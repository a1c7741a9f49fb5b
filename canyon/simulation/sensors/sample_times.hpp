#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

#include "canyon/geodesy/gps_time.hpp"

namespace canyon::simulation {

/// The intervals of a sensor's samples, one after another, from the begin of a run.
class SampleTimes {
 public:
  /// Since the begin of the run [s], in whole nanoseconds, as all instants.
  struct Interval {
    double from_s = 0, to_s = 0;
  };
  /// @param rate_hz > 0
  SampleTimes(geodesy::GpsTime begin, double rate_hz) : begin_(begin), rate_hz_(rate_hz) {}

  [[nodiscard]] geodesy::GpsTime begin() const { return begin_; }
  /// Intervals that next() or skip() has passed.
  [[nodiscard]] std::int64_t count() const { return count_; }
  [[nodiscard]] double end_s() const { return end_of(count_); }

  /// The next interval, if it has ended at `until`.
  [[nodiscard]] std::optional<Interval> next(geodesy::GpsTime until) {
    const Interval interval{end_of(count_), end_of(count_ + 1)};
    if (begin_ + interval.to_s > until) return std::nullopt;
    ++count_;
    return interval;
  }
  /// Passes the intervals that have ended at `time`; false: there is none.
  bool skip(geodesy::GpsTime time) {
    constexpr double kNanosecond = 1e-9;
    const auto count = static_cast<std::int64_t>(std::floor((time - begin_ + kNanosecond) * rate_hz_));
    if (count <= count_) return false;
    count_ = count;
    return true;
  }

 private:
  [[nodiscard]] double end_of(std::int64_t k) const {
    return std::round(static_cast<double>(k) / rate_hz_ * 1e9) / 1e9;
  }

  geodesy::GpsTime begin_;
  double rate_hz_;
  std::int64_t count_ = 0;
};

}  // namespace canyon::simulation
