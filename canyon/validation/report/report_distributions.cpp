// Declared in canyon/validation/report/report_pictures.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "canyon/geodesy/constants.hpp"
#include "canyon/output/number.hpp"
#include "canyon/validation/report/report_pictures.hpp"
#include "canyon/validation/report/report_samples.hpp"

// Pictures of distributions: of errors, and of C/N0 by elevation.

namespace canyon::validation {
namespace {

using drawing::Canvas;
using drawing::Point;
using drawing::Rect;

const drawing::Stroke kMeasuredLine{kMeasured, 2}, kSimulatedLine{kSimulated, 2, {7, 3}};

/// The empirical distribution function between the ends of the x axis, as steps.
std::vector<Point> step_curve(std::vector<double> values, const drawing::Plot& plot) {
  std::sort(values.begin(), values.end());
  const auto n = static_cast<double>(values.size());
  const auto first = std::lower_bound(values.begin(), values.end(), plot.x.low);
  double share = static_cast<double>(first - values.begin()) / n;
  std::vector<Point> curve{plot.at(plot.x.low, share)};
  for (auto v = first; v != values.end() && *v <= plot.x.high;) {
    const auto next = std::upper_bound(v, values.end(), *v);
    const Point foot = plot.at(*v, share);
    share = static_cast<double>(next - values.begin()) / n;
    const Point top = plot.at(*v, share);
    // Steps below a third of a unit are no longer seen as such.
    if (std::hypot(top.x - curve.back().x, top.y - curve.back().y) > 0.35 || next == values.end()) {
      curve.push_back(foot);
      curve.push_back(top);
    }
    v = next;
  }
  curve.push_back(plot.at(plot.x.high, share));
  return curve;
}

/// Holds the middle 96 % of both samples: tails would press the rest into a line.
drawing::Scale signed_scale(const SamplePair& pair) {
  double low = 0, high = 0;
  for (const auto* values : {&pair.measured, &pair.simulated}) {
    low = std::min(low, quantile(*values, 0.02).value_or(0));
    high = std::max(high, quantile(*values, 0.98).value_or(0));
  }
  return drawing::linear_scale(low, high, 6);
}

void draw_cdf(Canvas& canvas, const Rect& area, const std::string& title, const SamplePair& pair,
              const drawing::Scale& x, const std::string& x_label, bool with_y_label,
              const std::string& nothing) {
  drawing::Plot plot;
  plot.area = area;
  plot.x = x;
  plot.y.ticks = {0, 0.25, 0.5, 0.75, 1};
  plot.x_label = x_label;
  if (with_y_label) plot.y_label = "Share of values not above";
  plot.draw_ground(canvas);
  canvas.clipped({area.x, area.y - 1, area.width, area.height + 2}, [&] {
    if (plot.x.low < 0) {
      const double zero = plot.at(0, 0).x;
      canvas.segments({{{zero, area.y}, {zero, area.bottom()}}}, {drawing::kFaintInk, 1});
    }
    if (!pair.measured.empty()) canvas.polyline(step_curve(pair.measured, plot), kMeasuredLine);
    if (!pair.simulated.empty()) canvas.polyline(step_curve(pair.simulated, plot), kSimulatedLine);
  });
  plot.draw_frame(canvas);
  canvas.text({area.x, area.y - 12}, title, {.size = 14, .bold = true});
  const auto label = [&nothing](const std::string& name, const std::vector<double>& values) {
    const auto middle = median(values);
    if (!middle) return name + ": " + nothing;
    return fmt::format("{}: n {}, median {} m", name, values.size(), output::fixed(*middle, 1));
  };
  std::vector<drawing::LegendEntry> entries{
      {drawing::line_mark(kMeasuredLine), label("measured", pair.measured)},
      {drawing::line_mark(kSimulatedLine), label("simulated", pair.simulated)}};
  if (const auto ks = kolmogorov_smirnov(pair.measured, pair.simulated)) {
    entries.push_back({{}, fmt::format("KS distance {}", output::fixed(*ks, 3))});
  }
  // Below the frame's labels: curves run anywhere within it.
  drawing::draw_legend(canvas, {area.x, area.bottom() + 58}, entries);
}

}  // namespace

drawing::Picture draw_report_error_cdf(const ReportInput& input) {
  const ReportSamples samples = report_samples(*input.comparison, input.first, input.count);
  return drawing::render(1200, 622, [&](Canvas& canvas) {
    const double left = 84, top = 118, width = 330, height = 350, step = 375;
    drawing::draw_title(canvas, left, "Distributions of pseudorange and position errors",
                        report_subtitle(input));
    const std::string none = "none";
    draw_cdf(canvas, {left, top, width, height}, "Pseudorange errors, LOS", samples.error_los_m,
             signed_scale(samples.error_los_m), "Pseudorange error [m]", true, none);
    draw_cdf(canvas, {left + step, top, width, height}, "Pseudorange errors, NLOS", samples.error_nlos_m,
             signed_scale(samples.error_nlos_m), "Pseudorange error [m]", false, none);
    std::vector<double> all = samples.horizontal_m.measured;
    all.insert(all.end(), samples.horizontal_m.simulated.begin(), samples.horizontal_m.simulated.end());
    draw_cdf(canvas, {left + 2 * step, top, width, height}, "Horizontal errors of fixes",
             samples.horizontal_m, drawing::make_scale(all, 0), "Horizontal error [m]", false, "no fix");
  });
}

namespace {

constexpr double kBin_deg = 5;
constexpr std::size_t kBins = 18;
/// Quartiles of fewer values say little.
constexpr std::size_t kLeast = 5;

struct Cn0Bins {
  std::array<std::vector<double>, kBins> measured, simulated;
};

Cn0Bins cn0_bins(const ReportInput& input, bool clear) {
  Cn0Bins bins;
  for (std::size_t e = input.first; e < input.first + input.count; ++e) {
    for (const ComparedSatellite& s : satellites_of(*input.comparison, input.comparison->epochs[e])) {
      if (s.clear != clear) continue;
      const double bin = std::floor(geodesy::degrees(s.elevation_rad) / kBin_deg);
      const auto k = static_cast<std::size_t>(std::clamp(bin, 0.0, static_cast<double>(kBins - 1)));
      if (s.measured && s.measured_cn0_dbhz) bins.measured[k].push_back(*s.measured_cn0_dbhz);
      if (s.simulated && s.simulated_cn0_dbhz) bins.simulated[k].push_back(*s.simulated_cn0_dbhz);
    }
  }
  return bins;
}

void draw_cn0_panel(Canvas& canvas, const drawing::Plot& plot, const std::string& title,
                    const Cn0Bins& bins) {
  plot.draw_ground(canvas);
  std::size_t drawn = 0, measured = 0, simulated = 0;
  const auto draw = [&](const std::array<std::vector<double>, kBins>& values, double shift_deg,
                        const drawing::Colour& colour, drawing::Mark mark) {
    for (std::size_t k = 0; k < kBins; ++k) {
      if (values[k].size() < kLeast) continue;
      ++drawn;
      static constexpr std::array kQuartiles{0.25, 0.5, 0.75};
      const std::vector<double> q = quantiles(values[k], kQuartiles);
      const double x_deg = (static_cast<double>(k) + 0.5) * kBin_deg + shift_deg;
      const Point low = plot.at(x_deg, q[0]), high = plot.at(x_deg, q[2]);
      const bool dashed = mark == drawing::Mark::Triangle;
      canvas.segments({{low, high}},
                      {colour, 2.2, dashed ? std::vector<double>{4, 2} : std::vector<double>{}});
      canvas.segments(
          {{{low.x - 4, low.y}, {low.x + 4, low.y}}, {{high.x - 4, high.y}, {high.x + 4, high.y}}},
          {colour, 1.6});
      drawing::draw_mark(canvas, plot.at(x_deg, q[1]), mark, 5, colour);
    }
  };
  for (const auto& values : bins.measured) measured += values.size();
  for (const auto& values : bins.simulated) simulated += values.size();
  draw(bins.measured, -0.8, kMeasured, drawing::Mark::Disc);
  draw(bins.simulated, 0.8, kSimulated, drawing::Mark::Triangle);
  plot.draw_frame(canvas);
  canvas.text({plot.area.x, plot.area.y - 12}, title, {.size = 14, .bold = true});
  canvas.text({plot.area.right(), plot.area.y - 12},
              fmt::format("n {} measured, {} simulated", measured, simulated),
              {.size = 12, .colour = drawing::kFaintInk, .align = drawing::Align::Right});
  if (drawn == 0)
    plot.draw_note(canvas, measured + simulated == 0 ? "no value" : "fewer than 5 values in each bin");
}

}  // namespace

drawing::Picture draw_report_cn0(const ReportInput& input) {
  const std::array<Cn0Bins, 2> bins{cn0_bins(input, true), cn0_bins(input, false)};
  double low = 1e9, high = -1e9;
  for (const Cn0Bins& b : bins) {
    for (const auto* values : {&b.measured, &b.simulated}) {
      for (const auto& bin : *values) {
        if (bin.size() < kLeast) continue;
        low = std::min(low, *quantile(bin, 0.25));
        high = std::max(high, *quantile(bin, 0.75));
      }
    }
  }
  const drawing::Scale y =
      low <= high ? drawing::linear_scale(low, high, 7) : drawing::linear_scale(20, 50, 6);
  return drawing::render(1120, 560, [&](Canvas& canvas) {
    drawing::draw_title(canvas, 84, "C/N0 by elevation: median and quartiles in bins of 5\u00B0",
                        report_subtitle(input));
    const drawing::Scale x{0, 90, false, {0, 15, 30, 45, 60, 75, 90}};
    const drawing::Plot los{{84, 118, 480, 350}, x, y, "Elevation [\u00B0]", "C/N0 [dB-Hz]", {}};
    const drawing::Plot nlos{{612, 118, 480, 350}, x, y, "Elevation [\u00B0]", "", {}};
    draw_cn0_panel(canvas, los, "LOS", bins[0]);
    draw_cn0_panel(canvas, nlos, "NLOS", bins[1]);
    const auto mark = [](drawing::Mark shape, const drawing::Colour& colour, std::vector<double> dash) {
      return [=](Canvas& c, const Point& p) {
        c.segments({{{p.x, p.y - 9}, {p.x, p.y + 9}}}, {colour, 2.2, dash});
        drawing::draw_mark(c, p, shape, 4.5, colour);
      };
    };
    const double at_x =
        drawing::draw_legend_row(canvas, {84, 530},
                                 {{mark(drawing::Mark::Disc, kMeasured, {}), "measured"},
                                  {mark(drawing::Mark::Triangle, kSimulated, {4, 2}), "simulated"}});
    canvas.text({at_x, 530}, "mark: median, bar: quartiles; bins with fewer than 5 values are left out",
                {.size = 12, .colour = drawing::kFaintInk, .level = drawing::Level::Middle});
  });
}

}  // namespace canyon::validation
