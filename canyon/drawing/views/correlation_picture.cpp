#include "canyon/drawing/views/correlation_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/drawing/plot.hpp"

namespace canyon::drawing {
namespace {

using samples::CorrelationSeries;

constexpr double kWidth = 1000, kHeight = 830, kLeft = 74, kRight = 30;

double magnitude(const CorrelationSeries::Instant& instant, std::size_t k) {
  return std::abs(instant.values[k]);
}

double greatest(const CorrelationSeries& series) {
  double most = 0;
  for (const auto& instant : series.instants) {
    for (std::size_t k = 0; k < instant.values.size(); ++k) most = std::max(most, magnitude(instant, k));
  }
  return most > 0 ? most : 1;
}

std::size_t shown(const CorrelationSeries& series) {
  std::size_t best = series.instants.size() / 2;
  double largest = -1;
  for (std::size_t i = 0; i < series.instants.size(); ++i) {
    const double detour = std::abs(series.instants[i].measured_m);
    if (!(detour > largest)) continue;  // false of NaN
    largest = detour;
    best = i;
  }
  return best;
}

Colour path_colour(propagation::PathKind kind) {
  switch (kind) {
    case propagation::PathKind::Direct:
      return kGreen;
    case propagation::PathKind::Reflected:
      return kVermilion;
    case propagation::PathKind::Diffracted:
      return kPurple;
    default:
      return kFaintInk.with_alpha(0.5);
  }
}

/// A scale that ends where the values do.
Scale scale_of(double low, double high) {
  Scale scale;
  scale.low = low;
  scale.high = high > low ? high : low + 1;
  scale.ticks = linear_ticks(scale.low, scale.high, 8);
  return scale;
}

void draw_waterfall(Canvas& canvas, const CorrelationSeries& series, const Rect& area) {
  const auto& delays = series.delays_m;
  Plot plot;
  plot.area = area;
  plot.x = scale_of(series.instants.front().time_s, series.instants.back().time_s);
  plot.y = scale_of(delays.front(), delays.back());
  plot.x_label = "time [s]";
  plot.y_label = "delay after the line of sight [m]";
  plot.draw_ground(canvas);
  const auto columns = static_cast<int>(series.instants.size());
  constexpr int kRows = 300;
  const double most = greatest(series);
  std::vector<std::uint32_t> pixels;
  for (int row = 0; row < kRows; ++row) {
    const double delay = delays.back() + (delays.front() - delays.back()) * (row + 0.5) / kRows;
    const auto next = std::upper_bound(delays.begin(), delays.end() - 1, delay);
    const auto k = static_cast<std::size_t>(next - delays.begin());
    for (const auto& instant : series.instants)
      pixels.push_back(packed(viridis(magnitude(instant, k) / most)));
  }
  canvas.image(area, columns, kRows, pixels);
  std::vector<Point> line;
  canvas.clipped(area, [&] {
    for (const auto& instant : series.instants) {
      if (std::isnan(instant.measured_m)) {
        if (line.size() > 1) canvas.polyline(line, {kPaper, 1.6});
        line.clear();
      } else {
        line.push_back(plot.at(instant.time_s, instant.measured_m));
      }
    }
    if (line.size() > 1) canvas.polyline(line, {kPaper, 1.6});
  });
  plot.draw_frame(canvas);
}

void draw_instant(Canvas& canvas, const CorrelationSeries& series, const tracking::Correlation& shape,
                  const Rect& area) {
  const CorrelationSeries::Instant& instant = series.instants[shown(series)];
  const auto& delays = series.delays_m;
  double most = 0;
  for (std::size_t k = 0; k < delays.size(); ++k) most = std::max(most, magnitude(instant, k));
  for (const auto& path : instant.paths) most = std::max(most, path.amplitude);
  Plot plot;
  plot.area = area;
  plot.x = scale_of(delays.front(), delays.back());
  plot.y = linear_scale(0, most > 0 ? most : 1, 5);
  plot.x_label = fmt::format("delay after the line of sight [m], at {:.1f} s", instant.time_s);
  plot.y_label = "correlation";
  plot.draw_ground(canvas);
  canvas.clipped(area, [&] {
    const auto curve = [&](const auto& value, const Stroke& stroke) {
      std::vector<Point> points;
      for (std::size_t k = 0; k < delays.size(); ++k) points.push_back(plot.at(delays[k], value(k)));
      canvas.polyline(points, stroke);
    };
    for (const auto& path : instant.paths) {
      curve(
          [&](std::size_t k) {
            return std::abs(path.amplitude * shape.value((delays[k] - path.excess_m) / shape.chip_m()));
          },
          {path_colour(path.kind), path.kind == propagation::PathKind::Direct ? 1.6 : 1.0});
    }
    curve([&](std::size_t k) { return magnitude(instant, k); }, {kInk, 2.4});
    if (!std::isnan(instant.measured_m)) {
      canvas.segments({{plot.at(instant.measured_m, 0), plot.at(instant.measured_m, most)}}, {kBlue, 1.4});
    }
  });
  plot.draw_frame(canvas);
  const auto stroke_of = [](const Colour& colour, double width) {
    return [colour, width](Canvas& c, const Point& at) {
      c.segments({{{at.x - 12, at.y}, {at.x + 12, at.y}}}, {colour, width});
    };
  };
  std::vector<LegendEntry> entries{{stroke_of(kInk, 2.4), "sum of all paths"},
                                   {stroke_of(kBlue, 1.4), "measured detour"}};
  for (const auto& [kind, name] : {std::pair{propagation::PathKind::Direct, "line of sight"},
                                   {propagation::PathKind::Reflected, "reflections"},
                                   {propagation::PathKind::Diffracted, "around edges"},
                                   {propagation::PathKind::Diffuse, "scattering"}}) {
    const bool any = std::any_of(instant.paths.begin(), instant.paths.end(),
                                 [&, k = kind](const auto& path) { return path.kind == k; });
    if (any) entries.push_back({stroke_of(path_colour(kind), 1.4), name});
  }
  const Rect size = legend_size(canvas, entries);
  draw_legend(canvas, {area.x + area.width - size.width - 10, area.y + 10}, entries);
}

}  // namespace

Picture draw_correlation(const CorrelationSeries& series, const tracking::Correlation& shape) {
  const std::string title =
      fmt::format("Correlation of {} {}", gnss::to_string(series.satellite), series.signal);
  if (series.instants.empty()) return draw_notice(title, series.receiver, "no epoch");
  return render(kWidth, kHeight, [&](Canvas& canvas) {
    const double y =
        draw_title(canvas, kLeft, title,
                   fmt::format("receiver {}; magnitude over time and delay, the measured detour in white",
                               series.receiver));
    const double width = kWidth - kLeft - kRight;
    draw_waterfall(canvas, series, {kLeft, y + 8, width, 350});
    draw_instant(canvas, series, shape, {kLeft, y + 420, width, 260});
  });
}

}  // namespace canyon::drawing
