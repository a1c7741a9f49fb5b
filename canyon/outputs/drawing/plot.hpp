#pragma once

#include <functional>
#include <string>
#include <vector>

#include "canyon/outputs/drawing/canvas.hpp"

// Diagrams of values over values: axes, marks, legends.

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

/// A linear scale of whole steps that holds [low, high], about `count` of them; a range without width is
/// widened by 1 on both sides. Finite values, low <= high (asserted).
[[nodiscard]] Scale linear_scale(double low, double high, int count = 6);

/// Two axes about an area of the canvas: x to the right, y up.
struct Plot {
  Rect area;
  Scale x, y;
  std::string x_label, y_label;  ///< with units

  /// The point of a value pair. Values beyond the axes lie on the frame.
  [[nodiscard]] Point at(double x_value, double y_value) const;
  /// Draws ground and grid, before the values.
  void draw_ground(Canvas& canvas) const;
  /// Draws the frame, labels of ticks and the axes' names, after the values.
  void draw_frame(Canvas& canvas) const;
  /// Writes into the middle of the area why it is empty.
  void draw_note(Canvas& canvas, const std::string& note) const;
};

struct LegendEntry {
  std::function<void(Canvas&, const Point&)>
      mark;  ///< drawn about this point, at most 13 to each side; or none
  std::string label;
};
/// A mark for LegendEntry: a piece of a line.
[[nodiscard]] std::function<void(Canvas&, const Point&)> line_mark(const Stroke& stroke);
/// Size of a legend with these entries.
[[nodiscard]] Rect legend_size(Canvas& canvas, const std::vector<LegendEntry>& entries,
                               double text_size = 11.5);
/// A box of entries, one below the other; its upper left corner at `at`. Returns where it lies.
Rect draw_legend(Canvas& canvas, const Point& at, const std::vector<LegendEntry>& entries,
                 double text_size = 11.5);

/// A picture that holds nothing but its title and the reason.
[[nodiscard]] Picture draw_notice(const std::string& title, const std::string& subtitle,
                                  const std::string& notice);

}  // namespace canyon::drawing
