#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace canyon::simulation {

/// Times of a receiver's epochs: whole multiples of an interval after an offset, in nanoseconds since time 0,
/// so that receivers of one rate share their instants. Used by runs, live sessions and hosts.
class EpochSchedule {
 public:
  static constexpr std::int64_t kEndless = std::numeric_limits<std::int64_t>::max();

  /// @param interval_s > 0; kept in whole nanoseconds, at least one @param count of all epochs
  explicit EpochSchedule(double interval_s, std::int64_t count = kEndless)
      : interval_ns_(in_nanoseconds(interval_s)), count_(count) {}

  /// Number of epochs from time 0 to `duration_s`, both included. A tolerance of half a nanosecond allows for
  /// the rounding of `duration_s`.
  [[nodiscard]] static double count_within(double duration_s, double interval_s) {
    return std::floor((duration_s * 1e9 + 0.5) / static_cast<double>(in_nanoseconds(interval_s))) + 1;
  }
  /// The same schedule, shifted.
  [[nodiscard]] EpochSchedule lagging(std::int64_t offset_ns) const {
    EpochSchedule moved = *this;
    moved.offset_ns_ = offset_ns;
    return moved;
  }

  [[nodiscard]] std::int64_t interval_ns() const { return interval_ns_; }
  [[nodiscard]] double interval_s() const { return static_cast<double>(interval_ns_) * 1e-9; }
  [[nodiscard]] std::int64_t count() const { return count_; }
  /// The instant of an epoch; numbers count from 0.
  [[nodiscard]] std::int64_t at_ns(std::int64_t number) const { return number * interval_ns_ + offset_ns_; }
  /// The instant of the next epoch; one interval after the last epoch if none is left.
  [[nodiscard]] std::int64_t next_ns() const { return at_ns(next_); }
  [[nodiscard]] bool over() const { return next_ >= count_; }

  std::int64_t take() { return at_ns(next_++); }
  /// Makes this epoch the next one; the first one if `number` is negative.
  void go_to(std::int64_t number) { next_ = std::max<std::int64_t>(0, number); }
  /// Skips epochs: the latest one at or before `now_ns` is next. Returns the number of skipped epochs.
  std::int64_t catch_up(std::int64_t now_ns) {
    const std::int64_t before = next_;
    go_to(std::min(count_ - 1, (now_ns - offset_ns_) / interval_ns_));
    return next_ - before;
  }
  /// Starts with the latest epoch at or before `now_ns`; the number of epochs left does not change.
  void begin_at(std::int64_t now_ns) {
    const std::int64_t before = next_;
    go_to((now_ns - offset_ns_) / interval_ns_);
    if (count_ != kEndless) count_ += next_ - before;
  }

  /// For hosts with own time steps: true if an epoch is due in the step at `now_ns`, the first step at or
  /// after the epoch's instant. Call it once per step, in order; a time that goes back restarts the schedule.
  bool step(std::int64_t now_ns) {
    if (now_ns < step_ns_) next_ = 0;
    step_ns_ = now_ns;
    if (now_ns < next_ns()) return false;
    next_ = now_ns / interval_ns_ + 1;
    return true;
  }
  /// Sets another interval, starting at its first multiple that no step has reached.
  void set_interval(double interval_s) {
    interval_ns_ = in_nanoseconds(interval_s);
    if (next_ > 0) next_ = step_ns_ / interval_ns_ + 1;
  }

 private:
  static std::int64_t in_nanoseconds(double seconds) {
    return std::max<std::int64_t>(1, std::llround(seconds * 1e9));
  }

  std::int64_t interval_ns_;
  std::int64_t count_;
  std::int64_t offset_ns_ = 0;
  std::int64_t next_ = 0;
  std::int64_t step_ns_ = 0;  // the last step
};

}  // namespace canyon::simulation
