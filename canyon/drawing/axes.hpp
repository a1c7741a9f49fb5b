#pragma once

#include <string>
#include <vector>

namespace canyon::drawing {

/// 1, 2 or 5 times a power of ten: the smallest that is at least `x` (> 0, finite).
[[nodiscard]] double nice_ceil(double x);
/// The largest that is at most `x`.
[[nodiscard]] double nice_floor(double x);

/// Whole multiples of a nice step within [low, high], about `count` of them; low < high.
[[nodiscard]] std::vector<double> linear_ticks(double low, double high, int count);

/// Seconds between ticks of clock times, at least `at_least_s`: 1, 2, 5, 10, 15, 30 s, minutes, hours, days.
[[nodiscard]] double nice_time_step(double at_least_s);

/// "0.5", "20", "1500", "1e-05": as short as the number allows.
[[nodiscard]] std::string tick_label(double value);

/// A value axis from the data on it: linear from zero, or logarithmic where values spread over more than
/// a factor of 30 so that both ends stay readable.
struct Scale {
  double low = 0;
  double high = 1;
  bool logarithmic = false;
  std::vector<double> ticks;

  /// Position on the axis, 0 at `low`, 1 at `high`; clamped. NaN goes to 0.
  [[nodiscard]] double at(double value) const;
};

/// A logarithmic scale over the whole decades that hold [low, high]; 0 < low < high.
[[nodiscard]] Scale decade_scale(double low, double high);

/// A scale for values >= 0 that shows all but the smallest and largest `tail` share (0 to 0.5) of them. Not
/// finite ones are passed over; [0, 1] where nothing is left.
[[nodiscard]] Scale make_scale(std::vector<double> values, double tail);

}  // namespace canyon::drawing
