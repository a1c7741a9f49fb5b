#include "canyon/validation/report/map_picture.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/drawing/plot.hpp"
#include "canyon/validation/report/report_pictures.hpp"

namespace canyon::validation {
namespace {

using drawing::Canvas;
using drawing::Plot;
using drawing::Point;

/// Whole decades that hold all values but a hundredth at each end.
drawing::Scale decades(const std::vector<double>& values) {
  const double low = std::max(0.01, quantile(values, 0.01).value_or(0.1));
  return drawing::decade_scale(low, std::max(10 * low, quantile(values, 0.99).value_or(100)));
}

}  // namespace

drawing::Picture draw_map_judgement(const std::string& title, const std::vector<MapEpoch>& epochs) {
  std::vector<double> values;
  double longest_m = 1;
  for (const MapEpoch& e : epochs) {
    longest_m = std::max(longest_m, e.way_m);
    for (const double value : {e.error_m, e.p50_m, e.p95_m}) {
      if (std::isfinite(value) && value > 0) values.push_back(value);
    }
  }
  constexpr const char* kSubtitle =
      "recorded horizontal errors over the map's 50 % to 95 % at the same places";
  if (values.empty()) return drawing::draw_notice(title, kSubtitle, "the map has none of the places");
  return drawing::render(
      860, 480,
      [&](Canvas& canvas) {
        drawing::draw_title(canvas, 70, title, kSubtitle);
        Plot plot;
        plot.area = {70, 80, 760, 320};
        plot.x_label = "Way gone [m]";
        plot.y_label = "Horizontal error [m]";
        plot.x = drawing::linear_scale(0, longest_m, 8);
        plot.x.low = 0, plot.x.high = longest_m;
        plot.y = decades(values);
        plot.draw_ground(canvas);
        canvas.clipped(plot.area, [&] {
          // A strip to the next epoch; one that stands for a while is as wide as a line.
          for (std::size_t i = 0; i + 1 < epochs.size(); ++i) {
            const MapEpoch& e = epochs[i];
            if (!e.known || !std::isfinite(e.p50_m) || !std::isfinite(e.p95_m)) continue;
            const Point upper = plot.at(e.way_m, std::max(e.p95_m, plot.y.low));
            const Point lower = plot.at(epochs[i + 1].way_m, std::max(e.p50_m, plot.y.low));
            canvas.rectangle(
                {upper.x, upper.y, std::max(0.5, lower.x - upper.x), std::max(1.0, lower.y - upper.y)},
                kSimulated.with_alpha(0.45));
          }
          for (const MapEpoch& e : epochs) {
            if (e.solved) canvas.circle(plot.at(e.way_m, std::max(e.error_m, plot.y.low)), 1.6, kMeasured);
          }
        });
        plot.draw_frame(canvas);
        drawing::draw_legend(
            canvas, {plot.area.x + 8, plot.area.y + 8},
            {{[](Canvas& c, const Point& p) { c.circle(p, 2.4, kMeasured); }, "recorded fixes"},
             {[](Canvas& c, const Point& p) {
                c.rectangle({p.x - 11, p.y - 5, 22, 10}, kSimulated.with_alpha(0.45));
              },
              "map, 50 % to 95 %"}});
      },
      1.5);
}

}  // namespace canyon::validation
