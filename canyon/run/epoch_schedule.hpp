#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace canyon::simulation {

/// When the epochs of a receiver are due: at whole multiples of an interval behind an offset, in nanoseconds
/// since a time 0, so that receivers of one rate share their instants. Runs, live sessions and hosts ask it
/// for the next one.
class EpochSchedule {
 public:
  static constexpr std::int64_t kEndless = std::numeric_limits<std::int64_t>::max();

  /// @param interval_s > 0; kept in whole nanoseconds, at least one @param count of all epochs
  explicit EpochSchedule(double interval_s, std::int64_t count = kEndless)
      : interval_ns_(in_nanoseconds(interval_s)), count_(count) {}

  /// The number of epochs from time 0 to `duration_s`, both included; half a nanosecond is left for the
  /// rounding of `duration_s`.
  [[nodiscard]] static double count_within(double duration_s, double interval_s) {
    return std::floor((duration_s * 1e9 + 0.5) / static_cast<double>(in_nanoseconds(interval_s))) + 1;
  }
  /// The same schedule, moved.
  [[nodiscard]] EpochSchedule behind(std::int64_t offset_ns) const {
    EpochSchedule moved = *this;
    moved.offset_ns_ = offset_ns;
    return moved;
  }

  [[nodiscard]] std::int64_t interval_ns() const { return interval_ns_; }
  [[nodiscard]] double interval_s() const { return static_cast<double>(interval_ns_) * 1e-9; }
  [[nodiscard]] std::int64_t count() const { return count_; }
  /// The instant of an epoch, whose number counts from 0.
  [[nodiscard]] std::int64_t at_ns(std::int64_t number) const { return number * interval_ns_ + offset_ns_; }
  /// The instant of the next epoch; behind the last one where none is left.
  [[nodiscard]] std::int64_t next_ns() const { return at_ns(next_); }
  /// Every epoch was taken.
  [[nodiscard]] bool over() const { return next_ >= count_; }

  /// Takes the next epoch, and returns its instant.
  std::int64_t take() { return at_ns(next_++); }
  /// Makes this epoch the next one, the first one where `number` is negative.
  void go_to(std::int64_t number) { next_ = std::max<std::int64_t>(0, number); }
  /// Leaves out epochs: the latest one at or before `now_ns` is next. Returns how many.
  std::int64_t catch_up(std::int64_t now_ns) {
    const std::int64_t before = next_;
    go_to(std::min(count_ - 1, (now_ns - offset_ns_) / interval_ns_));
    return next_ - before;
  }
  /// Begins with the latest epoch at or before `now_ns`; as many epochs as before are left.
  void begin_at(std::int64_t now_ns) {
    const std::int64_t before = next_;
    go_to((now_ns - offset_ns_) / interval_ns_);
    if (count_ != kEndless) count_ += next_ - before;
  }

  /// For hosts whose time goes in steps of their own: whether the step at `now_ns` brings an epoch, as the
  /// first one at or after its instant does. Call it once a step, in order; time that goes back begins anew.
  bool step(std::int64_t now_ns) {
    if (now_ns < step_ns_) next_ = 0;
    step_ns_ = now_ns;
    if (now_ns < next_ns()) return false;
    next_ = now_ns / interval_ns_ + 1;
    return true;
  }
  /// Another interval, from the first of its multiples on that no step has reached.
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
