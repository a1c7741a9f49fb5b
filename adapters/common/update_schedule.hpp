#pragma once

#include <cmath>
#include <cstdint>

namespace canyon::adapters {

/// Chooses the updates of a world that bring an epoch: the first at or after each multiple of the interval,
/// counted from the world's time 0, so that receivers of one rate share their instants and a reset repeats
/// them.
class UpdateSchedule {
 public:
  /// @param rate_hz > 0; rates above the world's give an epoch at each update
  explicit UpdateSchedule(double rate_hz) : interval_ns_(interval_ns(rate_hz)) {}

  /// Another rate, likewise, from the first multiple of its interval on that has not been.
  void set_rate(double rate_hz) {
    interval_ns_ = interval_ns(rate_hz);
    if (next_ns_ > 0) next_ns_ = (last_ns_ / interval_ns_ + 1) * interval_ns_;
  }

  [[nodiscard]] double interval_s() const { return static_cast<double>(interval_ns_) * 1e-9; }

  /// Whether the update at `now_ns` of simulated time is due; call once per update, in order. Time that went
  /// back begins anew.
  bool due(std::int64_t now_ns) {
    if (now_ns < last_ns_) next_ns_ = 0;
    last_ns_ = now_ns;
    if (now_ns < next_ns_) return false;
    next_ns_ = (now_ns / interval_ns_ + 1) * interval_ns_;
    return true;
  }

 private:
  static std::int64_t interval_ns(double rate_hz) {
    return rate_hz >= 1e9 ? 1 : std::int64_t{std::llround(1e9 / rate_hz)};
  }

  std::int64_t interval_ns_;
  std::int64_t next_ns_ = 0;
  std::int64_t last_ns_ = 0;
};

}  // namespace canyon::adapters
