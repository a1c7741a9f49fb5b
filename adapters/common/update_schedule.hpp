#pragma once

#include <cmath>
#include <cstdint>

namespace canyon::adapters {

/// Which of a world's updates bring an epoch: the first at or after each multiple of the interval, counted
/// from the world's time 0, so that receivers of one rate share their instants and a reset repeats them.
class UpdateSchedule {
 public:
  /// @param rate_hz > 0; rates above the world's give an epoch at each update
  explicit UpdateSchedule(double rate_hz)
      : interval_ns_(rate_hz >= 1e9 ? 1 : std::int64_t{std::llround(1e9 / rate_hz)}) {}

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
  std::int64_t interval_ns_;
  std::int64_t next_ns_ = 0;
  std::int64_t last_ns_ = 0;
};

}  // namespace canyon::adapters
