#pragma once

#include <functional>
#include <string>

#include "canyon/city/fwd.hpp"
#include "canyon/drawing/canvas.hpp"
#include "canyon/drawing/plot.hpp"

// Scale bar, north arrow and other marks on maps. `area` of the canvas shows `extent` [m, ENU], north up.

namespace canyon::drawing {

/// Draws ticks below the area and to its left, with their labels and the axes' names.
void draw_frame_ticks(Canvas& canvas, const Rect& area, const city::Box& extent);

/// A bar of a round length, at the area's lower left.
void draw_scale_bar(Canvas& canvas, const Rect& area, const city::Box& extent);

/// Draws the arrow at the area's upper right.
void draw_north_arrow(Canvas& canvas, const Rect& area);

/// A vertical bar from `colour(0)` at its foot to `colour(1)`, `label` above it and ticks on its right;
/// returns the y below it.
double draw_colour_bar(Canvas& canvas, const Rect& bar, const std::string& label, const Scale& scale,
                       const std::function<Colour(double)>& colour);

}  // namespace canyon::drawing
