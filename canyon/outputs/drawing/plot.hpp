#pragma once

#include <functional>
#include <string>
#include <vector>

#include "canyon/outputs/drawing/canvas.hpp"

// Plots: axes, marks, legends.

namespace canyon::drawing {

/// 1, 2 or 5 times a power of ten: the smallest that is at least `x` (> 0, finite).
[[nodiscard]] double nice_ceil(double x);
/// 1, 2 or 5 times a power of ten: the largest that is at most `x`.
[[nodiscard]] double nice_floor(double x);

/// Whole multiples of a nice step within [low, high], about `count` of them; low < high.
[[nodiscard]] std::vector<double> linear_ticks(double low, double high, int count);

/// Seconds between ticks of clock times, at least `at_least_s`: 1, 2, 5, 10, 15, 30 s, minutes, hours, days.
[[nodiscard]] double nice_time_step(double at_least_s);

/// "0.5", "20", "1500", "1e-05": as short as the number allows.
[[nodiscard]] std::string tick_label(double value);

/// A value axis fitted to its data: linear from zero, or logarithmic if the values spread over more than a
/// factor of 30, so that both ends stay readable.
struct Scale {
  double low = 0;
  double high = 1;
  bool logarithmic = false;
  std::vector<double> ticks;

  /// Position on the axis, 0 at `low`, 1 at `high`; clamped. NaN: 0.
  [[nodiscard]] double at(double value) const;
};

/// A logarithmic scale over the whole decades that hold [low, high]; 0 < low < high.
[[nodiscard]] Scale decade_scale(double low, double high);

/// A scale for values >= 0 that leaves out the smallest and the largest fraction `tail` (0 to 0.5). Ignores
/// non-finite values; [0, 1] if no value is left.
[[nodiscard]] Scale make_scale(std::vector<double> values, double tail);

/// A linear scale of whole steps that covers [low, high], about `count` of them; an empty range is widened by
/// 1 on both sides. Finite values, low <= high (asserted).
[[nodiscard]] Scale linear_scale(double low, double high, int count = 6);

/// Two axes around an area of the canvas: x to the right, y up.
struct Plot {
  Rect area;
  Scale x, y;
  std::string x_label, y_label;  ///< with units

  /// The point of a value pair. Values outside the axes are clamped to the frame.
  [[nodiscard]] Point at(double x_value, double y_value) const;
  /// Draws background and grid, before the values.
  void draw_ground(Canvas& canvas) const;
  /// Draws the frame, labels of ticks and the axes' names, after the values.
  void draw_frame(Canvas& canvas) const;
  /// Writes the reason for an empty plot into the middle of the area.
  void draw_note(Canvas& canvas, const std::string& note) const;
};

struct LegendEntry {
  std::function<void(Canvas&, const Point&)>
      mark;  ///< drawn around this point, at most 13 to each side; or none
  std::string label;
};
/// A mark for LegendEntry: a piece of a line.
[[nodiscard]] std::function<void(Canvas&, const Point&)> line_mark(const Stroke& stroke);
/// Size of a legend with these entries.
[[nodiscard]] Rect legend_size(Canvas& canvas, const std::vector<LegendEntry>& entries,
                               double text_size = 11.5);
/// Draws a box of entries, one below the other, with its upper left corner at `at`. Returns its rectangle.
Rect draw_legend(Canvas& canvas, const Point& at, const std::vector<LegendEntry>& entries,
                 double text_size = 11.5);

/// A picture with only a title and the reason why there is no plot.
[[nodiscard]] Picture draw_notice(const std::string& title, const std::string& subtitle,
                                  const std::string& notice);

}  // namespace canyon::drawing
