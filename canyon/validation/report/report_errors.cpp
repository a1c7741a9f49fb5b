// Declared in canyon/validation/report/report_pictures.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "canyon/geodesy/time_scales.hpp"
#include "canyon/validation/epoch_interval.hpp"
#include "canyon/validation/report/report_pictures.hpp"
#include "canyon/validation/report/report_samples.hpp"

namespace canyon::validation {
namespace {

using drawing::Canvas;
using drawing::Point;
using drawing::Rect;

constexpr double kWidth = 1200, kHeight = 640;
constexpr double kLeft = 80, kPlotWidth = 1090;
constexpr drawing::Colour kOutside = drawing::rgb(0xE4E4E8);

class ErrorsAlong {
 public:
  explicit ErrorsAlong(const ReportInput& input) : input_(input), epochs_(input.comparison->epochs) {
    step_s_ = std::max(1e-3, interval_of(epochs_));
    const geodesy::CalendarTime t = geodesy::calendar_from_gps(epochs_.front().time);
    start_s_ = t.hour * 3600.0 + t.minute * 60.0 + t.second + static_cast<double>(t.nanosecond) * 1e-9;
    time_.low = start_s_ - 0.5 * step_s_;
    time_.high = seconds(epochs_.size() - 1) + 0.5 * step_s_;
    const double tick = drawing::nice_time_step((time_.high - time_.low) / 9);
    for (double s = std::ceil(time_.low / tick) * tick; s <= time_.high; s += tick) time_.ticks.push_back(s);
  }

  void draw(Canvas& canvas) const {
    drawing::draw_title(canvas, kLeft, "Horizontal error along the drive", report_subtitle(input_));
    const auto label = [](double s) {
      const long whole = std::lround(std::floor(s + 1e-6)) % 86400;
      return fmt::format("{:02}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
    };
    const drawing::Plot error{
        {kLeft, 124, kPlotWidth, 270},       time_, errors_scale(), "", "Horizontal error [m]",
        [](double) { return std::string(); }};
    const drawing::Plot used{
        {kLeft, 452, kPlotWidth, 120}, time_, used_scale(), "GPS time [h:min:s]", "Satellites used", label};
    draw_values(canvas, error, horizontal_error_m);
    draw_values(canvas, used, [](const ComparedFix& fix) {
      return fix.solved ? std::optional<double>(fix.used) : std::nullopt;
    });
    draw_segment_numbers(canvas, error.area);
    draw_availability(canvas, {kLeft, error.area.bottom() + 8, kPlotWidth, 30});
    draw_key(canvas);
  }

 private:
  [[nodiscard]] double seconds(std::size_t e) const {
    return start_s_ + (epochs_[e].time - epochs_.front().time);
  }
  [[nodiscard]] bool after_gap(std::size_t e) const {
    return e > 0 && epochs_[e].time - epochs_[e - 1].time > 1.5 * step_s_;
  }

  [[nodiscard]] drawing::Scale errors_scale() const {
    std::vector<double> values;
    for (const ComparedEpoch& epoch : epochs_) {
      for (const ComparedFix* fix : {&epoch.measured, &epoch.simulated}) {
        if (const auto error = horizontal_error_m(*fix)) values.push_back(*error);
      }
    }
    return drawing::make_scale(values, 0);
  }
  [[nodiscard]] drawing::Scale used_scale() const {
    int most = 4;
    for (const ComparedEpoch& epoch : epochs_)
      most = std::max({most, epoch.measured.used, epoch.simulated.used});
    drawing::Scale scale;
    scale.high = most + 1;
    for (const double tick : drawing::linear_ticks(0, scale.high, 4)) {
      if (tick == std::floor(tick)) scale.ticks.push_back(tick);
    }
    return scale;
  }

  /// The part of the drive that the figures are not of.
  void draw_outside(Canvas& canvas, const Rect& area) const {
    const auto shade = [&](double from_s, double to_s) {
      const double from = area.x + area.width * time_.at(from_s), to = area.x + area.width * time_.at(to_s);
      if (to > from) canvas.rectangle({from, area.y, to - from, area.height}, kOutside);
    };
    if (input_.count == 0) return shade(time_.low, time_.high);
    if (input_.first > 0) shade(time_.low, seconds(input_.first) - 0.5 * step_s_);
    const std::size_t last = input_.first + input_.count - 1;
    if (last + 1 < epochs_.size()) shade(seconds(last) + 0.5 * step_s_, time_.high);
  }

  void draw_values(Canvas& canvas, const drawing::Plot& plot,
                   const std::function<std::optional<double>(const ComparedFix&)>& value_of) const {
    canvas.rectangle(plot.area, drawing::kGround);
    draw_outside(canvas, plot.area);
    for (const double tick : plot.y.ticks) {
      const double y = plot.at(plot.x.low, tick).y;
      canvas.segments({{{plot.area.x, y}, {plot.area.right(), y}}}, {drawing::kInk.with_alpha(0.11), 0.8});
    }
    for (const Segment& segment : input_.comparison->segments) {
      if (segment.first == 0 || segment.first >= epochs_.size()) continue;
      const double x = plot.at(seconds(segment.first) - 0.5 * step_s_, plot.y.low).x;
      canvas.segments({{{x, plot.area.y}, {x, plot.area.bottom()}}}, {drawing::kFaintInk, 0.8, {2, 3}});
    }
    std::vector<Point> line;
    std::size_t drawn = 0;
    const auto end_line = [&] {
      if (line.size() == 1) drawing::draw_mark(canvas, line[0], drawing::Mark::Triangle, 2.2, kSimulated);
      canvas.polyline(line, {kSimulated, 1.5, {5, 2}});
      line.clear();
    };
    for (std::size_t e = 0; e < epochs_.size(); ++e) {
      const auto value = value_of(epochs_[e].simulated);
      if (!value || after_gap(e)) end_line();
      if (value) line.push_back(plot.at(seconds(e), *value));
      drawn += value ? 1U : 0U;
    }
    end_line();
    for (std::size_t e = 0; e < epochs_.size(); ++e) {
      const auto value = value_of(epochs_[e].measured);
      if (value) canvas.circle(plot.at(seconds(e), *value), 2.1, kMeasured);
      drawn += value ? 1U : 0U;
    }
    plot.draw_frame(canvas);
    if (drawn == 0) plot.draw_note(canvas, "no fix, neither measured nor simulated");
  }

  /// Numbers of street segments above the area, as the report's table has them.
  void draw_segment_numbers(Canvas& canvas, const Rect& area) const {
    const auto& segments = input_.comparison->segments;
    if (segments.empty()) return;
    const drawing::TextStyle style{
        .size = 10.5, .colour = drawing::kFaintInk, .align = drawing::Align::Centre};
    double free_from = area.x;
    for (std::size_t k = 0; k < segments.size(); ++k) {
      if (segments[k].count == 0 || segments[k].first + segments[k].count > epochs_.size()) continue;
      const double middle =
          0.5 * (seconds(segments[k].first) + seconds(segments[k].first + segments[k].count - 1));
      const double x = area.x + area.width * time_.at(middle);
      const std::string number = fmt::format("{}", k + 1);
      const double half = 0.5 * canvas.text_width(number, style);
      if (x - half < free_from) continue;
      canvas.text({x, area.y - 6}, number, style);
      free_from = x + half + 3;
    }
    canvas.text({area.x - 8, area.y - 6}, "street",
                {.size = 10.5, .colour = drawing::kFaintInk, .align = drawing::Align::Right});
  }

  /// One bar for each receiver, broken where it has no fix.
  void draw_availability(Canvas& canvas, const Rect& area) const {
    const auto bar = [&](double y, ComparedFix ComparedEpoch::*fix, const drawing::Colour& colour,
                         const std::string& name) {
      canvas.text({area.x - 8, y}, name,
                  {.size = 10.5,
                   .colour = drawing::kFaintInk,
                   .align = drawing::Align::Right,
                   .level = drawing::Level::Middle});
      for (std::size_t e = 0; e < epochs_.size();) {
        if (!(epochs_[e].*fix).solved) {
          ++e;
          continue;
        }
        std::size_t last = e;
        while (last + 1 < epochs_.size() && (epochs_[last + 1].*fix).solved && !after_gap(last + 1)) ++last;
        const double from = area.x + area.width * time_.at(seconds(e) - 0.5 * step_s_);
        const double to = area.x + area.width * time_.at(seconds(last) + 0.5 * step_s_);
        canvas.rectangle({from, y - 3.5, std::max(0.8, to - from), 7}, colour);
        e = last + 1;
      }
    };
    bar(area.y + 8, &ComparedEpoch::measured, kMeasured, "fix, meas.");
    bar(area.y + 22, &ComparedEpoch::simulated, kSimulated, "fix, sim.");
  }

  void draw_key(Canvas& canvas) const {
    std::vector<drawing::LegendEntry> entries{{[](Canvas& c, const Point& p) {
                                                 for (const double dx : {-9.0, 0.0, 9.0})
                                                   c.circle({p.x + dx, p.y}, 2.4, kMeasured);
                                               },
                                               "measured"},
                                              {drawing::line_mark({kSimulated, 1.6, {5, 2}}), "simulated"}};
    if (input_.comparison->segments.size() > 1) {
      entries.push_back({[](Canvas& c, const Point& p) {
                           c.polyline({{p.x, p.y - 8}, {p.x, p.y + 8}}, {drawing::kFaintInk, 1, {2, 3}});
                         },
                         "another street"});
    }
    if (input_.count < epochs_.size()) {
      entries.push_back(
          {[](Canvas& c, const Point& p) {
             c.rectangle({p.x - 12, p.y - 7, 24, 14}, kOutside, drawing::Stroke{drawing::kRule, 0.8});
           },
           "not in the figures"});
    }
    drawing::draw_legend_row(canvas, {kLeft, 90}, entries);
  }

  const ReportInput& input_;
  const std::vector<ComparedEpoch>& epochs_;
  double step_s_ = 1, start_s_ = 0;
  drawing::Scale time_;
};

}  // namespace

drawing::Picture draw_report_errors(const ReportInput& input) {
  if (input.comparison->epochs.empty()) {
    return drawing::draw_notice("Horizontal error along the drive", report_subtitle(input), "no epoch");
  }
  const ErrorsAlong picture(input);
  return drawing::render(kWidth, kHeight, [&](Canvas& canvas) { picture.draw(canvas); });
}

}  // namespace canyon::validation
