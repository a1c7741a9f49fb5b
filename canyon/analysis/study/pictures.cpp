#include "canyon/analysis/study/pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "canyon/base/output_file.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/outputs/drawing/plot.hpp"

namespace canyon::study {
namespace {

using drawing::Canvas;
using drawing::Plot;
using drawing::Point;
using drawing::Scale;

constexpr std::array kColours{drawing::kBlue,   drawing::kVermilion, drawing::kGreen, drawing::kOrange,
                              drawing::kPurple, drawing::kSkyBlue,   drawing::kBlack, drawing::kFaintInk};
constexpr std::size_t kMaxRendered = kColours.size();
/// More groups would hide each other with the bands of their 95 %.
constexpr std::size_t kMaxWithBothBands = 2;
const std::vector<double> kDashes[2] = {{}, {7, 3}};

drawing::Stroke stroke_of(std::size_t group) {
  return {kColours[group], 2, kDashes[group % 2]};
}

std::string name_of(const Group& group) {
  std::string name;
  for (const std::string& value : group.at) name += value + ", ";
  return name + group.receiver;
}

/// Sums of a count over a group's runs.
template <std::size_t N>
std::array<double, N> pooled(const Group& group, std::array<std::uint32_t, N> ReceiverRecord::*counts) {
  std::array<double, N> sum{};
  for (const ReceiverRecord* record : group.records)
    for (std::size_t i = 0; record != nullptr && i < N; ++i) sum[i] += (record->*counts)[i];
  return sum;
}

/// A logarithmic axis over whole decades that contain all errors but a thousandth at each end.
Scale error_scale(const GroupComparison& comparison, std::size_t sampled) {
  std::array<double, kErrorBins> all{};
  for (std::size_t g = 0; g < sampled; ++g) {
    const auto counts = pooled(comparison.groups[g], &ReceiverRecord::errors);
    for (std::size_t i = 0; i < kErrorBins; ++i) all[i] += counts[i];
  }
  const double total = std::accumulate(all.begin(), all.end(), 0.0);
  double below = 0, low = 0.1, high = 100;
  bool started = false;
  for (std::size_t i = 0; i < kErrorBins; ++i) {
    below += all[i];
    if (!started && below > 1e-3 * total) low = error_edge_m(i), started = true;
    if (below <= (1 - 1e-3) * total) high = error_edge_m(std::min(i + 2, kErrorBins));
  }
  return drawing::decade_scale(low, std::max(high, low * 10));
}

Scale fraction_scale(double high = 1) {
  Scale scale = drawing::linear_scale(0, high, 5);
  scale.low = 0;
  return scale;
}

class Sheet {
 public:
  Sheet(const Manifest& manifest, const GroupComparison& comparison)
      : manifest_(manifest),
        comparison_(comparison),
        rendered_(std::min(kMaxRendered, comparison.groups.size())) {}

  [[nodiscard]] drawing::Picture errors() const {
    return draw("Cumulative horizontal errors", "fraction of epochs whose fix has at most this error",
                [&](Canvas& canvas) {
                  Plot plot = make_plot("Horizontal error [m]", "Fraction of epochs");
                  plot.x = error_scale(comparison_, rendered_);
                  plot.y = fraction_scale();
                  draw_curves(canvas, plot, [&](const Group& group) {
                    const auto counts = pooled(group, &ReceiverRecord::errors);
                    const auto epochs = pooled(group, &ReceiverRecord::epochs);
                    const double total = std::accumulate(epochs.begin(), epochs.end(), 0.0);
                    std::vector<Point> curve;
                    double below = 0;
                    for (std::size_t i = 0; i < kErrorBins && total > 0; ++i) {
                      below += counts[i];
                      if (error_edge_m(i + 1) < plot.x.low) continue;
                      if (error_edge_m(i) > plot.x.high) break;
                      curve.push_back(plot.at(error_edge_m(i + 1), below / total));
                    }
                    return curve;
                  });
                });
  }

  [[nodiscard]] drawing::Picture availability() const {
    const std::string what = manifest_.available_m ? fmt::format("a fix within {} m", *manifest_.available_m)
                                                   : std::string("a fix");
    return draw("Availability by time of day", "fraction of epochs with " + what, [&](Canvas& canvas) {
      Plot plot = make_plot("Hour of the day, UTC", "Fraction of epochs");
      plot.x = drawing::linear_scale(0, 24, 8);
      plot.x.low = 0, plot.x.high = 24, plot.x.ticks = {0, 3, 6, 9, 12, 15, 18, 21, 24};
      plot.y = fraction_scale();
      // Hours without an epoch are gaps, single ones dots.
      const auto pieces = [&](const Group& group) {
        const auto epochs = pooled(group, &ReceiverRecord::epochs);
        const auto available = pooled(group, &ReceiverRecord::available);
        std::vector<std::vector<Point>> lines(1);
        for (std::size_t hour = 0; hour < 24; ++hour) {
          if (epochs[hour] == 0) {
            if (!lines.back().empty()) lines.emplace_back();
          } else {
            lines.back().push_back(plot.at(static_cast<double>(hour) + 0.5, available[hour] / epochs[hour]));
          }
        }
        return lines;
      };
      plot.draw_ground(canvas);
      for (std::size_t g = 0; g < rendered_; ++g) {
        for (const auto& line : pieces(comparison_.groups[g])) {
          if (line.size() > 1) canvas.polyline(line, stroke_of(g));
          for (const Point& at : line) canvas.circle(at, 2.6, kColours[g]);
        }
      }
      plot.draw_frame(canvas);
      legend(canvas, plot);
    });
  }

  [[nodiscard]] drawing::Picture along(const std::vector<std::vector<Stretch>>& stretches) const {
    std::vector<double> all{0};
    double longest_m = 1;
    for (std::size_t g = 0; g < rendered_; ++g) {
      for (const Stretch& stretch : stretches[g]) {
        longest_m = std::max(longest_m, stretch.to_m);
        if (!stretch.p95) continue;
        all.push_back(stretch.p95->mean);
        if (std::isfinite(stretch.p95->high)) all.push_back(stretch.p95->high);
      }
    }
    // A single large outlier must not determine the end of the scale.
    const double high = std::min(*std::max_element(all.begin(), all.end()), 3 * *quantile(all, 0.9));
    return draw(
        "Horizontal errors along the route",
        fmt::format("median (thick) and 95 % (thin), segments of {:g} m; bands: {:g} % intervals{} over runs",
                    manifest_.along_m.value_or(0), 100 * manifest_.confidence,
                    rendered_ > kMaxWithBothBands ? " of the median" : ""),
        [&](Canvas& canvas) {
          Plot plot = make_plot("Distance travelled [m]", "Horizontal error [m]");
          plot.x = drawing::linear_scale(0, longest_m, 8);
          plot.x.low = 0, plot.x.high = longest_m;
          plot.y = drawing::linear_scale(0, std::max(high, 0.01), 6);
          plot.y.low = 0;
          plot.draw_ground(canvas);
          canvas.clipped(plot.area, [&] {
            for (std::size_t g = 0; g < rendered_; ++g)
              for (const bool median : {false, true}) draw_along(canvas, plot, g, stretches[g], median);
          });
          plot.draw_frame(canvas);
          legend(canvas, plot);
        });
  }

  [[nodiscard]] drawing::Picture boxes() const {
    return draw("Errors of runs", "95 % of each run's horizontal error: quartiles, 5 % to 95 % of runs",
                [&](Canvas& canvas) {
                  Plot plot = make_plot("", "Horizontal error, 95 % [m]");
                  std::vector<std::vector<double>> values(rendered_);
                  std::vector<double> all;
                  for (std::size_t g = 0; g < rendered_; ++g) {
                    for (const ReceiverRecord* record : comparison_.groups[g].records) {
                      const auto value = record == nullptr ? std::nullopt : compared_metrics()[2].of(*record);
                      if (value) values[g].push_back(*value), all.push_back(*value);
                    }
                  }
                  plot.y = drawing::make_scale(all, 0);
                  plot.x.high = static_cast<double>(std::max<std::size_t>(1, rendered_));
                  plot.draw_ground(canvas);
                  for (std::size_t g = 0; g < rendered_; ++g) draw_box(canvas, plot, g, values[g]);
                  plot.draw_frame(canvas);
                  legend(canvas, plot);
                });
  }

 private:
  [[nodiscard]] drawing::Picture draw(const std::string& title, const std::string& subtitle,
                                      const std::function<void(Canvas&)>& content) const {
    const double legend_height = 30 + 19.5 * static_cast<double>(rendered_);
    std::string below = fmt::format("{}: {}", manifest_.title, subtitle);
    if (rendered_ < comparison_.groups.size())
      below += fmt::format(" (first {} of {} groups)", rendered_, comparison_.groups.size());
    return drawing::render(
        640, 510 + legend_height,
        [&](Canvas& canvas) {
          drawing::draw_title(canvas, 70, title, below);
          content(canvas);
        },
        1.5);
  }
  [[nodiscard]] static Plot make_plot(const std::string& x, const std::string& y) {
    Plot plot;
    plot.area = {70, 80, 540, 360};
    plot.x_label = x;
    plot.y_label = y;
    return plot;
  }
  void legend(Canvas& canvas, const Plot& plot) const {
    std::vector<drawing::LegendEntry> entries;
    for (std::size_t g = 0; g < rendered_; ++g)
      entries.push_back({drawing::line_mark(stroke_of(g)), name_of(comparison_.groups[g])});
    if (!entries.empty()) drawing::draw_legend(canvas, {plot.area.x, plot.area.bottom() + 52}, entries);
  }
  template <typename Curve>
  void draw_curves(Canvas& canvas, const Plot& plot, const Curve& curve) const {
    plot.draw_ground(canvas);
    canvas.clipped(plot.area, [&] {
      for (std::size_t g = 0; g < rendered_; ++g) {
        const std::vector<Point> points = curve(comparison_.groups[g]);
        if (points.size() > 1) canvas.polyline(points, stroke_of(g));
      }
    });
    plot.draw_frame(canvas);
    legend(canvas, plot);
  }
  /// Steps from segment to segment; those without a fix are gaps.
  void draw_along(Canvas& canvas, const Plot& plot, std::size_t group, const std::vector<Stretch>& stretches,
                  bool median) const {
    std::vector<Point> line;
    const auto flush = [&] {
      drawing::Stroke stroke = stroke_of(group);
      stroke.width = median ? 2.2 : 1;
      if (line.size() > 1) canvas.polyline(line, stroke);
      line.clear();
    };
    for (const Stretch& stretch : stretches) {
      const std::optional<MeanEstimate>& value = median ? stretch.median : stretch.p95;
      if (!value) {
        flush();
        continue;
      }
      line.push_back(plot.at(stretch.from_m, value->mean));
      line.push_back(plot.at(stretch.to_m, value->mean));
      if (!std::isfinite(value->low) || (!median && rendered_ > kMaxWithBothBands)) continue;
      const Point upper = plot.at(stretch.from_m, value->high), lower = plot.at(stretch.to_m, value->low);
      canvas.rectangle({upper.x, upper.y, lower.x - upper.x, lower.y - upper.y},
                       kColours[group].with_alpha(!median                         ? 0.15
                                                  : rendered_ > kMaxWithBothBands ? 0.18
                                                                                  : 0.35));
    }
    flush();
  }
  static void draw_box(Canvas& canvas, const Plot& plot, std::size_t group,
                       const std::vector<double>& values) {
    if (values.empty()) return;
    static constexpr std::array kRanks{0.05, 0.25, 0.5, 0.75, 0.95};
    const std::vector<double> q = quantiles(values, kRanks);
    const double middle = static_cast<double>(group) + 0.5;
    const auto at = [&](double aside, double value) { return plot.at(middle + aside, value); };
    const drawing::Stroke line{kColours[group], 1.6};
    canvas.segments({{at(0, q[0]), at(0, q[1])}, {at(0, q[3]), at(0, q[4])}}, line);
    const Point upper = at(-0.3, q[3]), lower = at(0.3, q[1]);
    canvas.rectangle({upper.x, upper.y, lower.x - upper.x, lower.y - upper.y},
                     kColours[group].with_alpha(0.25), line);
    canvas.segments({{at(-0.3, q[2]), at(0.3, q[2])}}, {kColours[group], 2.6});
  }

  const Manifest& manifest_;
  const GroupComparison& comparison_;
  std::size_t rendered_;
};

/// Writes a picture as PNG and SVG; returns the files' names.
std::vector<std::string> put(const std::filesystem::path& folder, const std::string& name,
                             const drawing::Picture& picture) {
  write_file(folder / (name + ".png"), picture.png);
  write_file(folder / (name + ".svg"), picture.svg);
  return {name + ".png", name + ".svg"};
}

}  // namespace

std::vector<std::string> write_along_pictures(const std::filesystem::path& folder, const Manifest& manifest,
                                              const GroupComparison& comparison,
                                              const std::vector<std::vector<Stretch>>& along) {
  return put(folder, "along", Sheet(manifest, comparison).along(along));
}

std::vector<std::string> write_study_pictures(const std::filesystem::path& folder, const Manifest& manifest,
                                              const GroupComparison& comparison) {
  const Sheet sheet(manifest, comparison);
  std::vector<std::string> names;
  for (const auto& [name, picture] : {std::pair{"errors", sheet.errors()}, std::pair{"boxes", sheet.boxes()},
                                      std::pair{"availability", sheet.availability()}})
    for (std::string& file : put(folder, name, picture)) names.push_back(std::move(file));
  return names;
}

}  // namespace canyon::study
