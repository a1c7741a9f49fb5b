#include "canyon/drawing/plot.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "canyon/geodesy/constants.hpp"

namespace canyon::drawing {
namespace {

constexpr double kSwatch = 34;  // room for an entry's mark
constexpr double kPadding = 8;  // of a legend's box

double line_height(double text_size) {
  return 1.65 * text_size;
}

}  // namespace

Scale linear_scale(double low, double high, int count) {
  assert(std::isfinite(low) && std::isfinite(high) && low <= high);
  if (high - low < 1e-9 * std::max(1.0, std::abs(high))) {
    low -= 1;
    high += 1;
  }
  const double step = nice_ceil((high - low) / count);
  Scale scale;
  scale.low = step * std::floor(low / step + 1e-9);
  scale.high = step * std::ceil(high / step - 1e-9);
  scale.ticks = linear_ticks(scale.low, scale.high, count + 2);
  return scale;
}

Point Plot::at(double x_value, double y_value) const {
  return {area.x + area.width * x.at(x_value), area.bottom() - area.height * y.at(y_value)};
}

void Plot::draw_ground(Canvas& canvas) const {
  canvas.rectangle(area, kGround);
  std::vector<std::pair<Point, Point>> lines;
  for (const double tick : x.ticks) {
    const double at_x = at(tick, y.low).x;
    lines.push_back({{at_x, area.y}, {at_x, area.bottom()}});
  }
  for (const double tick : y.ticks) {
    const double at_y = at(x.low, tick).y;
    lines.push_back({{area.x, at_y}, {area.right(), at_y}});
  }
  canvas.segments(lines, {kInk.with_alpha(0.11), 0.8});
}

void Plot::draw_frame(Canvas& canvas) const {
  canvas.rectangle(area, {}, Stroke{kFaintInk, 0.9});
  for (const double tick : x.ticks) {
    const double at_x = at(tick, y.low).x;
    canvas.segments({{{at_x, area.bottom()}, {at_x, area.bottom() + 4}}}, {kFaintInk, 0.8});
    canvas.text({at_x, area.bottom() + 8}, tick_label(tick),
                {.size = 11, .colour = kFaintInk, .align = Align::Centre, .level = Level::Top});
  }
  double widest = 0;
  for (const double tick : y.ticks) {
    const double at_y = at(x.low, tick).y;
    const TextStyle style{.size = 11, .colour = kFaintInk, .align = Align::Right, .level = Level::Middle};
    canvas.segments({{{area.x - 4, at_y}, {area.x, at_y}}}, {kFaintInk, 0.8});
    canvas.text({area.x - 8, at_y}, tick_label(tick), style);
    widest = std::max(widest, canvas.text_width(tick_label(tick), style));
  }
  canvas.text({area.centre().x, area.bottom() + 28}, x_label,
              {.size = 12.5, .align = Align::Centre, .level = Level::Top});
  canvas.text(
      {area.x - widest - 22, area.centre().y}, y_label,
      {.size = 12.5, .align = Align::Centre, .level = Level::Middle, .angle_rad = -0.5 * geodesy::kPi});
}

void Plot::draw_note(Canvas& canvas, const std::string& note) const {
  canvas.text(area.centre(), note,
              {.size = 13, .colour = kFaintInk, .align = Align::Centre, .level = Level::Middle, .halo = 3});
}

std::function<void(Canvas&, const Point&)> line_mark(const Stroke& stroke) {
  return [stroke](Canvas& canvas, const Point& at) {
    canvas.polyline({{at.x - 13, at.y}, {at.x + 13, at.y}}, stroke);
  };
}

Rect legend_size(Canvas& canvas, const std::vector<LegendEntry>& entries, double text_size) {
  double widest = 0;
  for (const LegendEntry& entry : entries) {
    widest =
        std::max(widest, canvas.text_width(entry.label, {.size = text_size}) + (entry.mark ? kSwatch : 0));
  }
  return {0, 0, widest + 2 * kPadding,
          static_cast<double>(entries.size()) * line_height(text_size) + kPadding};
}

Rect draw_legend(Canvas& canvas, const Point& at, const std::vector<LegendEntry>& entries, double text_size) {
  Rect box = legend_size(canvas, entries, text_size);
  box.x = at.x;
  box.y = at.y;
  canvas.rectangle(box, kPaper.with_alpha(0.88), Stroke{kRule, 0.8});
  double y = box.y + 0.5 * kPadding + 0.5 * line_height(text_size);
  for (const LegendEntry& entry : entries) {
    if (entry.mark) entry.mark(canvas, {box.x + kPadding + 13, y});
    canvas.text({box.x + kPadding + (entry.mark ? kSwatch : 0), y}, entry.label,
                {.size = text_size, .level = Level::Middle});
    y += line_height(text_size);
  }
  return box;
}

Picture draw_notice(const std::string& title, const std::string& subtitle, const std::string& notice) {
  return render(900, 220, [&](Canvas& canvas) {
    draw_title(canvas, 40, title, subtitle);
    const Plot plot{{40, 84, 820, 96}, {}, {}, "", ""};
    canvas.rectangle(plot.area, kGround, Stroke{kRule, 1});
    plot.draw_note(canvas, notice);
  });
}

}  // namespace canyon::drawing
