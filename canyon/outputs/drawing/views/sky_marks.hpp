#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "canyon/outputs/drawing/canvas.hpp"
#include "canyon/outputs/drawing/views/sky_picture.hpp"
#include "canyon/outputs/drawing/views/sky_render.hpp"

// Draws marks, names and tracks on pictures of the sky. Sizes in units of a sheet 990 wide.

namespace canyon::drawing {

inline constexpr Colour kSkySilhouette = rgb(0xC9CCD1);

/// Fills the parts of the sky that the surroundings hide.
void draw_sky_mask(Canvas& canvas, const SkyLens& lens, const SkyMask& mask);
/// Horizon, circles of elevation, lines of azimuth with their names beyond the rim; the elevation mask [rad]
/// as a dashed circle unless 0.
void draw_sky_grid(Canvas& canvas, const SkyLens& lens, double elevation_mask_rad);
/// Centre of the label of an azimuth, outside the rim.
[[nodiscard]] Point sky_rim_label(const SkyLens& lens, int azimuth_deg);

/// LOS disc, LOS with multipath ringed disc, NLOS triangle, blocked cross.
void draw_satellite_mark(Canvas& canvas, const Point& at, propagation::Visibility visibility);
/// Draws in the colour of the satellite's visibility: a diamond for a reflected signal, a square for one bent
/// around an edge, a small pale disc for a scattered one.
void draw_reflection_mark(Canvas& canvas, const Point& at, propagation::Visibility visibility,
                          propagation::PathKind kind);
/// Pieces with one visibility each. `cased`: with a pale rim, for a background that is not plain.
void draw_trail(Canvas& canvas, const SkyLens& lens, const std::vector<SkyPoint>& trail, bool cased);

/// Finds positions of texts that overlap no marks and no earlier texts: right, left, above or below the mark.
class SkyLabels {
 public:
  /// Reserves the area around a mark. Returns its number.
  std::size_t add_mark(const Point& at, double half_size);
  /// Draws `text` next to the mark `own` at `at`.
  void draw(Canvas& canvas, const Point& at, std::size_t own, const std::string& text, TextStyle style);

 private:
  std::vector<Rect> taken_;
};

}  // namespace canyon::drawing
