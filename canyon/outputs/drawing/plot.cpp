#include "canyon/outputs/drawing/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/statistics.hpp"

namespace canyon::drawing {
namespace {

constexpr double kSwatch = 34;  // width of an entry's mark
constexpr double kPadding = 8;  // of a legend's box

double line_height(double text_size) {
  return 1.65 * text_size;
}

constexpr double kLogarithmicFrom = 30;
/// Prevents rounding from changing 5 to 10.
constexpr double kSlack = 1e-9;

std::vector<double> log_ticks(double low, double high) {
  std::vector<double> ticks;
  const bool every = high / low <= 2e3;
  for (double decade = std::pow(10, std::floor(std::log10(low))); decade <= high * (1 + kSlack);
       decade *= 10) {
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double tick = decade * factor;
      if ((every || factor == 1.0) && tick >= low * (1 - kSlack) && tick <= high * (1 + kSlack))
        ticks.push_back(tick);
    }
  }
  return ticks;
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
                {.size = 11, .colour = kFaintInk, .align = Align::Centre, .level = TextLevel::Top});
  }
  double widest = 0;
  for (const double tick : y.ticks) {
    const double at_y = at(x.low, tick).y;
    const TextStyle style{.size = 11, .colour = kFaintInk, .align = Align::Right, .level = TextLevel::Middle};
    canvas.segments({{{area.x - 4, at_y}, {area.x, at_y}}}, {kFaintInk, 0.8});
    canvas.text({area.x - 8, at_y}, tick_label(tick), style);
    widest = std::max(widest, canvas.text_width(tick_label(tick), style));
  }
  canvas.text({area.centre().x, area.bottom() + 28}, x_label,
              {.size = 12.5, .align = Align::Centre, .level = TextLevel::Top});
  canvas.text(
      {area.x - widest - 22, area.centre().y}, y_label,
      {.size = 12.5, .align = Align::Centre, .level = TextLevel::Middle, .angle_rad = -0.5 * geodesy::kPi});
}

void Plot::draw_note(Canvas& canvas, const std::string& note) const {
  canvas.text(
      area.centre(), note,
      {.size = 13, .colour = kFaintInk, .align = Align::Centre, .level = TextLevel::Middle, .halo = 3});
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
                {.size = text_size, .level = TextLevel::Middle});
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

double nice_ceil(double x) {
  const double decade = std::pow(10, std::floor(std::log10(x)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (decade * factor >= x * (1 - kSlack)) return decade * factor;
  return 10 * decade;
}

double nice_floor(double x) {
  const double decade = std::pow(10, std::floor(std::log10(x)));
  for (const double factor : {5.0, 2.0})
    if (decade * factor <= x * (1 + kSlack)) return decade * factor;
  return decade;
}

std::vector<double> linear_ticks(double low, double high, int count) {
  const double step = nice_ceil((high - low) / count);
  std::vector<double> ticks;
  for (double k = std::ceil(low / step - kSlack); k * step <= high + kSlack * step; ++k)
    ticks.push_back(k * step + 0.0);
  return ticks;
}

double nice_time_step(double at_least_s) {
  static constexpr std::array kSteps{0.1,    0.2,    0.5,    1.0,     2.0,     5.0,    10.0,
                                     15.0,   30.0,   60.0,   120.0,   300.0,   600.0,  900.0,
                                     1800.0, 3600.0, 7200.0, 10800.0, 21600.0, 43200.0};
  for (const double step : kSteps)
    if (step >= at_least_s) return step;
  return 86400 * std::max(1.0, std::ceil(at_least_s / 86400));
}

std::string tick_label(double value) {
  if (value == 0) return "0";
  return fmt::format("{:.4g}", value);
}

double Scale::at(double value) const {
  if (std::isnan(value)) return 0;
  if (!logarithmic) return std::clamp((value - low) / (high - low), 0.0, 1.0);
  if (value <= low) return 0;
  return std::clamp(std::log(value / low) / std::log(high / low), 0.0, 1.0);
}

Scale decade_scale(double low, double high) {
  Scale scale;
  scale.logarithmic = true;
  scale.low = std::pow(10, std::floor(std::log10(low) + kSlack));
  scale.high = std::pow(10, std::ceil(std::log10(high) - kSlack));
  for (double tick = scale.low; tick < 1.5 * scale.high; tick *= 10) scale.ticks.push_back(tick);
  return scale;
}

Scale make_scale(std::vector<double> values, double tail) {
  std::erase_if(values, [](double v) { return !std::isfinite(v) || v < 0; });
  Scale scale;
  if (!values.empty()) {
    const double high = *quantile(values, 1 - tail);
    const double low = *quantile(values, std::max(tail, 0.02));
    if (low > 0 && high / low > kLogarithmicFrom) {
      scale.logarithmic = true;
      scale.high = nice_ceil(high);
      // Shows at most four decades: smaller values are practically perfect.
      scale.low = std::max(nice_floor(low), scale.high * 1e-4);
      scale.ticks = log_ticks(scale.low, scale.high);
      return scale;
    }
    if (high > 0) {
      // A little above the largest value, so that it is not drawn on the frame.
      const double step = nice_ceil(high / 5);
      scale.high = step * std::ceil(1.03 * high / step - kSlack);
    }
  }
  scale.ticks = linear_ticks(scale.low, scale.high, 5);
  return scale;
}

}  // namespace canyon::drawing
