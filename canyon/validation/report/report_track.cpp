// Declared in canyon/validation/report/report_pictures.hpp.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/drawing/views/map_marks.hpp"
#include "canyon/drawing/views/track_picture.hpp"
#include "canyon/output/number.hpp"
#include "canyon/validation/report/report_pictures.hpp"
#include "canyon/validation/report/report_samples.hpp"

namespace canyon::validation {
namespace {

using drawing::Canvas;
using drawing::Point;
using drawing::Rect;

constexpr double kLargestPanelWidth = 620, kLargestPanelHeight = 640;
constexpr double kTrackLeft = 76, kTrackTop = 132, kBetween = 40, kBelow = 62;

/// One kind of fixes on its map.
struct Panel {
  std::string name;
  ComparedFix ComparedEpoch::*fix;
  drawing::Colour colour;
  drawing::Mark mark;
};

class TrackMaps {
 public:
  explicit TrackMaps(const ReportInput& input)
      : input_(input), turn_(-input.comparison->registration.heading_rad) {
    std::vector<drawing::TrackPoint> points;
    for (const Panel& panel : kPanels) {
      for (std::size_t e = input.first; e < input.first + input.count; ++e) points.push_back(point(panel, e));
    }
    extent_ = drawing::map_extent(points);
    const Eigen::Vector3d size = extent_.max - extent_.min;
    beside_ = size.x() < 1.4 * size.y();
    const double widest = beside_ ? kLargestPanelWidth : 2 * kLargestPanelWidth;
    const double units = std::min(widest / size.x(), kLargestPanelHeight / size.y());
    width_ = units * size.x();
    height_ = units * size.y();
  }

  [[nodiscard]] double width() const {
    return std::max(820.0, kTrackLeft + width_ + (beside_ ? kBetween + width_ : 0) + 24);
  }
  [[nodiscard]] double height() const { return kTrackTop + height_ + (beside_ ? 0 : kBelow + height_) + 84; }

  void draw(Canvas& canvas) const {
    drawing::draw_title(canvas, kTrackLeft, "Recorded and simulated fixes over the city",
                        report_subtitle(input_));
    for (std::size_t k = 0; k < kPanels.size(); ++k) {
      const double shift = static_cast<double>(k);
      const Rect area{kTrackLeft + (beside_ ? shift * (width_ + kBetween) : 0),
                      kTrackTop + (beside_ ? 0 : shift * (height_ + kBelow)), width_, height_};
      draw_panel(canvas, kPanels[k], area, k == 0);
    }
    draw_marks(canvas);
  }

 private:
  static constexpr std::array<Panel, 2> kPanels{
      {{"Measured", &ComparedEpoch::measured, kMeasured, drawing::Mark::Disc},
       {"Simulated", &ComparedEpoch::simulated, kSimulated, drawing::Mark::Triangle}}};

  /// In the city's axes, which a heading of its registration turns against the truth's.
  [[nodiscard]] drawing::TrackPoint point(const Panel& panel, std::size_t e) const {
    const ComparedEpoch& epoch = input_.comparison->epochs[e];
    drawing::TrackPoint p;
    p.truth = epoch.place_enu_m.head<2>();
    if (const ComparedFix& fix = epoch.*panel.fix; fix.solved) {
      p.fix = p.truth + Eigen::Rotation2Dd(turn_) * Eigen::Vector2d(fix.error_enu_m.head<2>());
      p.error_m = fix.error_enu_m.head<2>().norm();
    }
    return p;
  }

  void draw_panel(Canvas& canvas, const Panel& panel, const Rect& area, bool first) const {
    const auto place = [&](const Eigen::Vector2d& p) { return drawing::map_point(area, extent_, p); };
    std::vector<Point> truth, fixes;
    std::vector<std::pair<Point, Point>> errors;
    std::vector<Point> without;
    std::vector<double> lengths;
    std::size_t beyond = 0;
    for (std::size_t e = input_.first; e < input_.first + input_.count; ++e) {
      const drawing::TrackPoint p = point(panel, e);
      truth.push_back(place(p.truth));
      if (!p.fix) {
        without.push_back(truth.back());
        continue;
      }
      fixes.push_back(place(*p.fix));
      errors.emplace_back(truth.back(), fixes.back());
      lengths.push_back(p.error_m);
      if (!area.contains(fixes.back())) ++beyond;
    }
    canvas.rectangle(area, drawing::kGround);
    canvas.clipped(area, [&] {
      drawing::draw_buildings(canvas, area, input_.city->mesh, extent_);
      canvas.segments(errors, {panel.colour.with_alpha(0.45), 0.8});
      canvas.polyline(truth, {drawing::kPaper.with_alpha(0.9), 4.5});
      canvas.polyline(truth, {drawing::kInk, 1.8});
      for (const Point& at : without) drawing::draw_mark(canvas, at, drawing::Mark::Cross, 4, drawing::kInk);
      for (const Point& at : fixes) drawing::draw_mark(canvas, at, panel.mark, 3, panel.colour);
      if (first) {
        drawing::draw_scale_bar(canvas, area, extent_);
        drawing::draw_north_arrow(canvas, area);
      }
    });
    canvas.rectangle(area, {}, drawing::Stroke{drawing::kFaintInk, 1});
    canvas.text({area.x, area.y - 30}, panel.name, {.size = 14, .bold = true});
    std::string words = fmt::format("{} fixes of {} epochs", fixes.size(), input_.count);
    if (const auto middle = median(lengths)) {
      words += fmt::format(", median error {} m", output::fixed(*middle, 1));
    }
    if (beyond > 0) words += fmt::format(", {} off the map", beyond);
    drawing::TextStyle style{.size = 12, .colour = drawing::kFaintInk};
    style.size *= std::min(1.0, area.width / canvas.text_width(words, style));
    canvas.text({area.x, area.y - 11}, words, style);
    // Maps that share an axis share its labels.
    if (beside_ || !first) {
      drawing::draw_east_ticks(canvas, area, extent_, 5);
      drawing::name_east_axis(canvas, area, 24);
    }
    if (beside_ && !first) return;
    drawing::draw_north_ticks(canvas, area, extent_, 6);
    drawing::name_north_axis(canvas, area, 52);
  }

  /// Legend of the marks, one row at the foot.
  void draw_marks(Canvas& canvas) const {
    const auto mark = [](drawing::Mark shape, const drawing::Colour& colour) {
      return [=](Canvas& c, const Point& p) { drawing::draw_mark(c, p, shape, 4, colour); };
    };
    std::vector<drawing::LegendEntry> entries{
        {drawing::line_mark({drawing::kInk, 1.8}), "true track"},
        {mark(drawing::Mark::Disc, kMeasured), "measured fix"},
        {mark(drawing::Mark::Triangle, kSimulated), "simulated fix"},
        {drawing::line_mark({drawing::kFaintInk, 0.9}), "error, from the true place to the fix"}};
    if (somewhere_no_fix()) entries.push_back({mark(drawing::Mark::Cross, drawing::kInk), "no fix"});
    drawing::draw_legend_row(canvas, {kTrackLeft, height() - 18}, entries);
  }
  [[nodiscard]] bool somewhere_no_fix() const {
    const auto begin = input_.comparison->epochs.begin() + static_cast<std::ptrdiff_t>(input_.first);
    return std::any_of(begin, begin + static_cast<std::ptrdiff_t>(input_.count),
                       [](const ComparedEpoch& e) { return !e.measured.solved || !e.simulated.solved; });
  }

  const ReportInput& input_;
  double turn_;
  city::Box extent_;
  bool beside_ = true;  ///< else one above the other
  double width_ = 0, height_ = 0;
};

}  // namespace

drawing::Picture draw_report_track(const ReportInput& input) {
  if (input.count == 0) {
    return drawing::draw_notice("Recorded and simulated fixes over the city", report_subtitle(input),
                                "no epoch");
  }
  const TrackMaps maps(input);
  return drawing::render(maps.width(), maps.height(), [&](Canvas& canvas) { maps.draw(canvas); });
}

}  // namespace canyon::validation
