#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/statistics.hpp"
#include "canyon/city/fwd.hpp"
#include "canyon/outputs/drawing/canvas.hpp"
#include "canyon/outputs/drawing/plot.hpp"

namespace canyon::drawing {

/// One epoch on the map, in the city's ENU frame [m].
struct TrackPoint {
  Eigen::Vector2d truth = Eigen::Vector2d::Zero();
  std::optional<Eigen::Vector2d> fix;  ///< empty: no fix
  double error_m = 0;                  ///< horizontal, of the fix
};

/// A run from above.
struct TrackDrawing {
  std::string title;
  std::string subtitle;
  const city::Mesh* mesh = nullptr;  ///< must outlive the drawing; may be null (open field)
  std::vector<TrackPoint> points;    ///< in order of time; not empty
  std::size_t epochs = 0;            ///< all epochs of the points, and those without a fix
  std::size_t without_fix = 0;
  Distribution error_m;  ///< horizontal, of all fixes
};

/// The part of a city that a map shows [m, ENU]: the true track and all but the farthest 2 % of the fixes
/// (none with an error above the larger of the track's diagonal and 100 m), with a margin of a tenth, at
/// least 60 m wide and high with an aspect ratio of at most 1 to 2. z is 0.
[[nodiscard]] city::Box map_extent(const std::vector<TrackPoint>& points);

/// Buildings shaded by the height of their roofs, the true track, fixes coloured by horizontal error, hollow
/// marks without a fix, arrows at the rim to fixes off the map, colour bars, scale bar, north arrow.
[[nodiscard]] Picture draw_track(const TrackDrawing& drawing);

/// Buildings as filled roofs, higher ones on top; `area` of the canvas shows `extent`. Buildings that extend
/// beyond it are not clipped. Returns the highest roof seen [m]; 0 if there is none.
double draw_buildings(Canvas& canvas, const Rect& area, const city::Mesh& mesh, const city::Box& extent);

/// Edges of roofs from above, including steps of roofs, for the buildings in the extent [m, ENU].
using Outlines = std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>>;
[[nodiscard]] Outlines building_outlines(const city::Mesh& mesh, const city::Box& extent);

/// Maps a point of the plane to a point of `area`; `area` shows `extent`, north up. Both axes have the same
/// scale if area and extent have the same aspect ratio.
[[nodiscard]] Point map_point(const Rect& area, const city::Box& extent, const Eigen::Vector2d& east_north);

// Scale bar, north arrow and other marks on maps. `area` of the canvas shows `extent` [m, ENU], north up.
/// Draws ticks below the area and to its left, with their labels and the axes' names.
void draw_frame_ticks(Canvas& canvas, const Rect& area, const city::Box& extent);

/// Draws a scale bar of a round length at the area's lower left.
void draw_scale_bar(Canvas& canvas, const Rect& area, const city::Box& extent);

/// Draws the north arrow at the area's upper right.
void draw_north_arrow(Canvas& canvas, const Rect& area);

/// Draws a vertical colour bar from `colour(0)` at its foot to `colour(1)`, `label` above it and ticks on its
/// right; returns the y below it.
double draw_colour_bar(Canvas& canvas, const Rect& bar, const std::string& label, const Scale& scale,
                       const std::function<Colour(double)>& colour);

}  // namespace canyon::drawing
