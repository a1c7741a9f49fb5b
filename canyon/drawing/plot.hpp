#pragma once

#include <functional>
#include <string>
#include <vector>

#include "canyon/drawing/axes.hpp"
#include "canyon/drawing/canvas.hpp"

// Diagrams of values over values: axes, marks, legends.

namespace canyon::drawing {

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
