#include "canyon/outputs/drawing/views/timeline_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/outputs/drawing/plot.hpp"

namespace canyon::drawing {
namespace {

constexpr double kTimelineWidth = 1200;
constexpr double kTimelineHeight = 800;
constexpr double kStrengthHeight = 170;  // additional height with C/N0
constexpr double kPlotLeft = 84;
constexpr double kPlotWidth = 940;
constexpr double kFaultRow = 18;
constexpr Colour kFault = rgb(0xCC79A7);
constexpr Colour kShade = rgb(0xF4DDCF);
constexpr Colour kHorizontal = kBlue;
constexpr Colour kVertical = kOrange;
constexpr Colour kUsed = kGreen;
constexpr Colour kUnused = rgb(0x9BD9C4);
constexpr Colour kHidden = rgb(0xC4C7CC);

class Timeline {
 public:
  explicit Timeline(const TimelineDrawing& drawing) : drawing_(drawing), points_(drawing.points) {
    begin_ = points_.front().time;
    length_s_ = points_.back().time - begin_;
    step_s_ = median_step();
    if (length_s_ <= 0) length_s_ = step_s_;
  }

  void draw(Canvas& canvas) {
    draw_title(canvas, kPlotLeft, drawing_.title, drawing_.subtitle);
    const double down = faults_height(drawing_);
    const Rect error{kPlotLeft, 92 + down, kPlotWidth, 260};
    const Rect satellites{kPlotLeft, 392 + down, kPlotWidth, 170};
    const Rect hdop{kPlotLeft, 602 + down, kPlotWidth, 130};
    draw_values(canvas, error, "Error [m]",
                {{&TimelinePoint::vertical_m, kVertical}, {&TimelinePoint::error_m, kHorizontal}});
    draw_satellites(canvas, satellites);
    draw_values(canvas, hdop, "HDOP", {{&TimelinePoint::hdop, kPurple}});
    if (!has_strength(drawing_)) {
      draw_times(canvas, hdop, {error, satellites, hdop});
    } else {
      const Rect strength{kPlotLeft, hdop.bottom() + 40, kPlotWidth, kStrengthHeight - 40};
      draw_strength(canvas, strength);
      draw_times(canvas, strength, {error, satellites, hdop, strength});
    }
    draw_legend(canvas, error, satellites);
    draw_faults(canvas, {error, satellites, hdop});
  }

  /// Height of the rows of faults at the top of the picture.
  [[nodiscard]] static double faults_height(const TimelineDrawing& drawing) {
    if (drawing.faults.empty()) return 0;
    return kFaultRow * static_cast<double>(std::min(drawing.faults.size(), kMaxFaultRows)) + 12;
  }

  [[nodiscard]] static bool has_strength(const TimelineDrawing& drawing) {
    return std::any_of(drawing.points.begin(), drawing.points.end(), [](const TimelinePoint& p) {
      return std::isfinite(p.cn0_los_dbhz) || std::isfinite(p.cn0_nlos_dbhz);
    });
  }

 private:
  [[nodiscard]] double median_step() const {
    std::vector<double> steps;
    for (std::size_t i = 1; i < points_.size(); ++i) steps.push_back(points_[i].time - points_[i - 1].time);
    const double middle_s = median(steps).value_or(1);
    return middle_s > 0 ? middle_s : 1;
  }

  /// Each epoch represents the interval around it.
  [[nodiscard]] double x_at(const Rect& area, double t_s) const {
    return area.x + area.width * (t_s + 0.5 * step_s_) / (length_s_ + step_s_);
  }
  [[nodiscard]] double seconds(const TimelinePoint& p) const { return p.time - begin_; }

  void draw_outages(Canvas& canvas, const Rect& area) const {
    for (std::size_t i = 0; i < points_.size();) {
      if (!std::isnan(points_[i].error_m)) {
        ++i;
        continue;
      }
      std::size_t last = i;
      while (last + 1 < points_.size() && std::isnan(points_[last + 1].error_m)) ++last;
      const double from = std::max(area.x, x_at(area, seconds(points_[i]) - 0.5 * step_s_));
      const double to = std::min(area.right(), x_at(area, seconds(points_[last]) + 0.5 * step_s_));
      canvas.rectangle({from, area.y, std::max(0.7, to - from), area.height}, kShade);
      i = last + 1;
    }
  }

  void draw_faults(Canvas& canvas, const std::vector<Rect>& areas) const {
    Rect row{kPlotLeft, 92, kPlotWidth, kFaultRow - 4};
    for (std::size_t i = 0; i < std::min(drawing_.faults.size(), kMaxFaultRows); ++i) {
      const TimelineFault& fault = drawing_.faults[i];
      for (const auto& [first, last] : fault.stretches) {
        const double from = std::max(row.x, x_at(row, first - begin_ - 0.5 * step_s_));
        const double to = std::min(row.right(), x_at(row, last - begin_ + 0.5 * step_s_));
        const double width = std::max(1.0, to - from);
        canvas.rectangle({from, row.y, width, row.height}, kFault);
        for (const Rect& area : areas)
          canvas.rectangle({from, area.y, width, area.height}, kFault.with_alpha(0.07));
      }
      const bool more = i + 1 == kMaxFaultRows && drawing_.faults.size() > kMaxFaultRows;
      const std::string label =
          more ? fmt::format("{} and {} more", fault.name, drawing_.faults.size() - kMaxFaultRows)
               : fault.name;
      canvas.text({row.right() + 22, row.centre().y}, label, {.size = 11, .level = TextLevel::Middle});
      row.y += kFaultRow;
    }
  }

  void draw_grid(Canvas& canvas, const Rect& area, const Scale& scale) const {
    for (const double tick : scale.ticks) {
      const double y = area.bottom() - area.height * scale.at(tick);
      canvas.segments({{{area.x, y}, {area.right(), y}}}, {kInk.with_alpha(0.12), 0.8});
      canvas.text({area.x - 8, y}, tick_label(tick),
                  {.size = 11, .colour = kFaintInk, .align = Align::Right, .level = TextLevel::Middle});
    }
  }

  void draw_label(Canvas& canvas, const Rect& area, const std::string& label) const {
    canvas.text(
        {area.x - 56, area.centre().y}, label,
        {.size = 12.5, .align = Align::Centre, .level = TextLevel::Middle, .angle_rad = -0.5 * geodesy::kPi});
  }

  struct Series {
    double TimelinePoint::*value;
    Colour colour;
  };
  /// The values of all series.
  [[nodiscard]] std::vector<double> values_of(const std::vector<Series>& series) const {
    std::vector<double> values;
    for (const Series& each : series) {
      for (const TimelinePoint& p : points_)
        if (std::isfinite(p.*each.value)) values.push_back(p.*each.value);
    }
    return values;
  }
  void draw_values(Canvas& canvas, const Rect& area, const std::string& label,
                   const std::vector<Series>& series) const {
    const Scale scale = make_scale(values_of(series), 0);
    draw_values(canvas, area, scale.logarithmic ? label + ", logarithmic" : label, series, scale);
  }
  void draw_values(Canvas& canvas, const Rect& area, const std::string& label,
                   const std::vector<Series>& series, const Scale& scale) const {
    canvas.rectangle(area, kGround);
    draw_outages(canvas, area);
    draw_grid(canvas, area, scale);
    for (const Series& each : series) draw_series(canvas, area, scale, each);
    canvas.rectangle(area, {}, Stroke{kFaintInk, 0.9});
    draw_label(canvas, area, label);
  }

  void draw_strength(Canvas& canvas, const Rect& area) const {
    const Colour los_colour = colour_of(propagation::Visibility::LOS);
    const Colour nlos_colour = colour_of(propagation::Visibility::NLOS);
    const std::vector<Series> series{{&TimelinePoint::cn0_nlos_dbhz, nlos_colour},
                                     {&TimelinePoint::cn0_los_dbhz, los_colour}};
    const std::vector<double> values = values_of(series);
    const auto [least, maximum] = std::minmax_element(values.begin(), values.end());
    constexpr double kStep_db = 10;
    Scale scale;
    scale.low = kStep_db * std::floor(*least / kStep_db);
    scale.high = kStep_db * (std::floor(*maximum / kStep_db) + 1);
    for (double tick = scale.low; tick <= scale.high; tick += kStep_db) scale.ticks.push_back(tick);
    draw_values(canvas, area, "C/N0 [dB-Hz]", series, scale);
    draw_swatch(canvas, area, 12, los_colour, "LOS, mean");
    if (!values_of({{series.front()}}).empty()) draw_swatch(canvas, area, 36, nlos_colour, "NLOS, mean");
  }

  void draw_series(Canvas& canvas, const Rect& area, const Scale& scale, const Series& series) const {
    const Colour& colour = series.colour;
    const auto y_at = [&](double value) { return area.bottom() - area.height * scale.at(value); };
    canvas.clipped({area.x, area.y - 2, area.width, area.height + 4}, [&] {
      if (points_.size() > static_cast<std::size_t>(2 * kPlotWidth)) {
        draw_columns(canvas, area, series, y_at);
        return;
      }
      const double dot = points_.size() > 600 ? 1.4 : 2.0;
      std::vector<Point> line;
      for (std::size_t i = 0; i < points_.size(); ++i) {
        const bool gap = i > 0 && points_[i].time - points_[i - 1].time > 1.5 * step_s_;
        const double value = points_[i].*series.value;
        if (std::isnan(value) || gap) {
          canvas.polyline(line, {colour.with_alpha(0.55), 1.2});
          line.clear();
        }
        if (!std::isnan(value)) line.push_back({x_at(area, seconds(points_[i])), y_at(value)});
      }
      canvas.polyline(line, {colour.with_alpha(0.55), 1.2});
      for (const TimelinePoint& p : points_) {
        if (std::isnan(p.*series.value)) continue;
        canvas.circle({x_at(area, seconds(p)), y_at(p.*series.value)}, dot, colour);
      }
    });
  }

  /// Smallest and largest value of each column, one unit wide.
  void draw_columns(Canvas& canvas, const Rect& area, const Series& series,
                    const std::function<double(double)>& y_at) const {
    const auto columns = static_cast<std::size_t>(area.width);
    std::vector<double> low(columns, std::numeric_limits<double>::infinity());
    std::vector<double> high(columns, -std::numeric_limits<double>::infinity());
    for (const TimelinePoint& p : points_) {
      const double value = p.*series.value;
      if (std::isnan(value)) continue;
      const double x = x_at(area, seconds(p)) - area.x;
      const std::size_t c = std::min(static_cast<std::size_t>(std::max(0.0, x)), columns - 1);
      low[c] = std::min(low[c], value);
      high[c] = std::max(high[c], value);
    }
    std::vector<std::pair<Point, Point>> bars;
    for (std::size_t c = 0; c < columns; ++c) {
      if (low[c] > high[c]) continue;
      const double x = area.x + static_cast<double>(c) + 0.5;
      bars.push_back({{x, y_at(low[c]) + 0.6}, {x, y_at(high[c]) - 0.6}});
    }
    canvas.segments(bars, {series.colour, 1.1});
  }

  void draw_satellites(Canvas& canvas, const Rect& area) const {
    canvas.rectangle(area, kGround);
    int maximum = 1;
    for (const TimelinePoint& p : points_) maximum = std::max(maximum, p.visible + p.blocked);
    Scale scale;
    scale.high = maximum + 1;
    for (const double tick : linear_ticks(0, scale.high, 5))
      if (tick == std::floor(tick)) scale.ticks.push_back(tick);
    const auto layer = [&](const Colour& colour, const std::function<int(const TimelinePoint&)>& top_of) {
      // Steps: each epoch's count over its interval. Many epochs: each column's minimum, to show dips.
      std::vector<Point> outline{{area.x, area.bottom()}};
      double last_x = area.x;
      for (std::size_t i = 0; i < points_.size();) {
        int top = top_of(points_[i]);
        double to = x_at(area, seconds(points_[i]) + 0.5 * step_s_);
        for (++i; i < points_.size() && to - last_x < 0.5; ++i) {
          top = std::min(top, top_of(points_[i]));
          to = x_at(area, seconds(points_[i]) + 0.5 * step_s_);
        }
        const double y = area.bottom() - area.height * scale.at(top);
        outline.push_back({last_x, y});
        outline.push_back({to, y});
        last_x = to;
      }
      outline.push_back({last_x, area.bottom()});
      canvas.polygons({outline}, colour);
    };
    canvas.clipped(area, [&] {
      layer(kHidden, [](const TimelinePoint& p) { return p.visible + p.blocked; });
      layer(kUnused, [](const TimelinePoint& p) { return p.visible; });
      layer(kUsed, [](const TimelinePoint& p) { return p.used; });
    });
    draw_grid(canvas, area, scale);
    canvas.rectangle(area, {}, Stroke{kFaintInk, 0.9});
    draw_label(canvas, area, "Satellites above mask");
  }

  void draw_times(Canvas& canvas, const Rect& below, const std::vector<Rect>& areas) const {
    const geodesy::CalendarTime first = geodesy::utc_from_gps(begin_);
    const double first_s = first.hour * 3600.0 + first.minute * 60.0 + first.second +
                           static_cast<double>(first.nanosecond) * 1e-9;
    const double step = nice_time_step(length_s_ / 9);
    for (double clock = std::ceil(first_s / step) * step; clock <= first_s + length_s_; clock += step) {
      const double x = x_at(below, clock - first_s);
      for (const Rect& area : areas)
        canvas.segments({{{x, area.y}, {x, area.bottom()}}}, {kInk.with_alpha(0.1), 0.8});
      canvas.segments({{{x, below.bottom()}, {x, below.bottom() + 5}}}, {kFaintInk, 0.9});
      const geodesy::CalendarTime at = geodesy::utc_from_gps(begin_ + (clock - first_s + 1e-6));
      std::string label = fmt::format("{:02}:{:02}", at.hour, at.minute);
      if (std::fmod(step, 60) != 0) label += fmt::format(":{:02}", at.second);
      if (step < 1) label += fmt::format(".{}", at.nanosecond / 100'000'000);
      canvas.text({x, below.bottom() + 10}, label,
                  {.size = 11, .colour = kFaintInk, .align = Align::Centre, .level = TextLevel::Top});
    }
    canvas.text({below.centre().x, below.bottom() + 32}, "UTC",
                {.size = 12, .align = Align::Centre, .level = TextLevel::Top});
  }

  /// Draws a label next to an area, at this distance below its upper edge.
  static void draw_swatch(Canvas& canvas, const Rect& area, double below, const Colour& colour,
                          const std::string& label) {
    const double x = area.right() + 22, y = area.y + below;
    canvas.rectangle({x, y - 7, 18, 14}, colour, Stroke{kFaintInk, 0.6});
    canvas.text({x + 26, y}, label, {.size = 12, .level = TextLevel::Middle});
  }

  void draw_legend(Canvas& canvas, const Rect& error, const Rect& satellites) const {
    if (std::any_of(points_.begin(), points_.end(),
                    [](const TimelinePoint& p) { return std::isnan(p.error_m); }))
      draw_swatch(canvas, error, 60, kShade, "no fix");
    draw_swatch(canvas, error, 12, kHorizontal, "horizontal");
    draw_swatch(canvas, error, 36, kVertical, "vertical, absolute");
    draw_swatch(canvas, satellites, 12, kHidden, "not tracked");
    draw_swatch(canvas, satellites, 36, kUnused, "tracked, unused");
    draw_swatch(canvas, satellites, 60, kUsed, "in the fix");
  }

  const TimelineDrawing& drawing_;
  const std::vector<TimelinePoint>& points_;
  geodesy::GpsTime begin_;
  double length_s_ = 1;
  double step_s_ = 1;
};

}  // namespace

Picture draw_timeline(const TimelineDrawing& drawing) {
  const double height = kTimelineHeight + Timeline::faults_height(drawing) +
                        (Timeline::has_strength(drawing) ? kStrengthHeight : 0);
  return render(kTimelineWidth, height, [&drawing](Canvas& canvas) { Timeline(drawing).draw(canvas); });
}

}  // namespace canyon::drawing
