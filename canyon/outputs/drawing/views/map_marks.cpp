// Declared in canyon/outputs/drawing/views/track_picture.hpp.
#include <fmt/format.h>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/outputs/drawing/views/track_picture.hpp"

namespace canyon::drawing {

void draw_frame_ticks(Canvas& canvas, const Rect& area, const city::Box& extent) {
  const TextStyle below{.size = 10.5, .colour = kFaintInk, .align = Align::Centre, .level = Level::Top};
  TextStyle beside = below, upright = below;
  beside.align = Align::Right;
  beside.level = Level::Middle;
  upright.angle_rad = -0.5 * geodesy::kPi;
  for (const double east : linear_ticks(extent.min.x(), extent.max.x(), 8)) {
    const double x = map_point(area, extent, {east, extent.min.y()}).x;
    canvas.segments({{{x, area.bottom()}, {x, area.bottom() + 4}}}, {kFaintInk, 0.8});
    canvas.text({x, area.bottom() + 8}, fmt::format("{:.0f}", east), below);
  }
  for (const double north : linear_ticks(extent.min.y(), extent.max.y(), 7)) {
    const double y = map_point(area, extent, {extent.min.x(), north}).y;
    canvas.segments({{{area.x - 4, y}, {area.x, y}}}, {kFaintInk, 0.8});
    canvas.text({area.x - 7, y}, fmt::format("{:.0f}", north), beside);
  }
  canvas.text({area.centre().x, area.bottom() + 26}, "east of the city's origin [m]", below);
  canvas.text({area.x - 48, area.centre().y}, "north of the city's origin [m]", upright);
}

void draw_scale_bar(Canvas& canvas, const Rect& area, const city::Box& extent) {
  const double units_per_metre = area.width / (extent.max.x() - extent.min.x());
  const double length_m = nice_floor(0.22 * area.width / units_per_metre);
  const double length = length_m * units_per_metre;
  const Rect box{area.x + 14, area.bottom() - 42, length + 24, 30};
  canvas.rectangle(box, kPaper.with_alpha(0.85));
  const double y = box.bottom() - 8;
  canvas.polyline(
      {{box.x + 12, y - 5}, {box.x + 12, y}, {box.x + 12 + length, y}, {box.x + 12 + length, y - 5}},
      {kInk, 1.6});
  canvas.text({box.x + 12 + 0.5 * length, y - 5},
              length_m >= 1000 ? fmt::format("{:g} km", length_m / 1000) : fmt::format("{:g} m", length_m),
              {.size = 11.5, .align = Align::Centre});
}

void draw_north_arrow(Canvas& canvas, const Rect& area) {
  const Point tip{area.right() - 30, area.y + 16};
  canvas.circle({tip.x, tip.y + 20}, 27, kPaper.with_alpha(0.85));
  canvas.polygons({{tip, {tip.x + 7, tip.y + 24}, {tip.x, tip.y + 19}, {tip.x - 7, tip.y + 24}}}, kInk);
  canvas.text({tip.x, tip.y + 38}, "N", {.size = 12, .bold = true, .align = Align::Centre});
}

double draw_colour_bar(Canvas& canvas, const Rect& bar, const std::string& label, const Scale& scale,
                       const std::function<Colour(double)>& colour) {
  canvas.text({bar.x, bar.y - 10}, label, {.size = 12, .bold = true});
  const int steps = static_cast<int>(bar.height);
  for (int i = 0; i < steps; ++i) {
    canvas.rectangle({bar.x, bar.bottom() - i - 1.0, bar.width, 1.3}, colour((i + 0.5) / steps));
  }
  canvas.rectangle(bar, {}, Stroke{kFaintInk, 0.8});
  for (const double tick : scale.ticks) {
    const double y = bar.bottom() - bar.height * scale.at(tick);
    canvas.segments({{{bar.right(), y}, {bar.right() + 4, y}}}, {kFaintInk, 0.8});
    canvas.text({bar.right() + 8, y}, tick_label(tick), {.size = 11, .level = Level::Middle});
  }
  return bar.bottom();
}

}  // namespace canyon::drawing
