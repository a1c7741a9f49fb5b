#include "canyon/analysis/bench/page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "canyon/base/payload.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/drawing/canvas.hpp"
#include "canyon/outputs/drawing/plot.hpp"

namespace canyon::bench {
namespace {

using drawing::Canvas;
using drawing::Point;
using Tracks = std::map<std::string, Track>;
using Errors = std::vector<std::vector<double>>;  // of each track, in their order

constexpr std::array<drawing::Colour, 6> kColours{drawing::kFaintInk, drawing::kBlue,   drawing::kVermilion,
                                                  drawing::kGreen,    drawing::kPurple, drawing::kOrange};
drawing::Stroke stroke_of(std::size_t estimate) {
  return {kColours.at(estimate % kColours.size()), 1.4, {}};
}

/// A picture as an element of a page.
std::string picture(int width, int height, const std::function<void(Canvas&)>& draw) {
  constexpr double kScale = 1.5;
  const auto pixels = [&](int units) { return static_cast<int>(kScale * units); };
  return fmt::format("<img width=\"{}\" height=\"{}\" alt=\"\" src=\"data:image/png;base64,{}\">\n", width,
                     height, base64(drawing::render_png(pixels(width), pixels(height), kScale, draw)));
}

/// Draws lines that are interrupted at missing values.
void draw_line(Canvas& canvas, const drawing::Plot& plot, const std::vector<double>& x,
               const std::vector<double>& y, const drawing::Stroke& stroke) {
  std::vector<Point> line;
  for (std::size_t i = 0; i <= x.size(); ++i) {
    if (i < x.size() && std::isfinite(x[i]) && std::isfinite(y[i])) {
      line.push_back(plot.at(x[i], y[i]));
    } else if (!line.empty()) {
      canvas.polyline(line, stroke);
      line.clear();
    }
  }
}

std::vector<double> axis_of(const Track& track, int axis) {
  std::vector<double> values;
  for (const Eigen::Vector3d& position : track.enu_m) values.push_back(position(axis));
  return values;
}

/// Truth and estimates in plan view; points far from the drive are drawn on the frame.
std::string map_picture(const DriveFolder& drive, const Tracks& tracks) {
  return picture(460, 420, [&](Canvas& canvas) {
    const std::vector<double> east = axis_of(drive.truth, 0), north = axis_of(drive.truth, 1);
    const auto [west, far_east] = std::minmax_element(east.begin(), east.end());
    const auto [south, far_north] = std::minmax_element(north.begin(), north.end());
    const double half = std::max(*far_east - *west, *far_north - *south) / 2 + 30;
    const double middle_east = (*west + *far_east) / 2, middle_north = (*south + *far_north) / 2;
    drawing::Plot plot{{55, 12, 390, 360},
                       drawing::linear_scale(middle_east - half, middle_east + half),
                       drawing::linear_scale(middle_north - half, middle_north + half),
                       "east [m]",
                       "north [m]"};
    plot.draw_ground(canvas);
    draw_line(canvas, plot, east, north, {drawing::kInk, 3, {}});
    std::size_t k = 0;
    for (const auto& [name, track] : tracks)
      draw_line(canvas, plot, axis_of(track, 0), axis_of(track, 1), stroke_of(k++));
    plot.draw_frame(canvas);
  });
}

/// Errors over time, with events as bands.
std::string error_picture(const DriveFolder& drive, Errors errors) {
  return picture(760, 300, [&](Canvas& canvas) {
    double largest = 1;
    for (std::vector<double>& of : errors)
      for (double& error : of)
        if (std::isfinite(error)) largest = std::max(largest, error = std::max(error, 0.1));
    drawing::Plot plot{{55, 12, 690, 240},
                       drawing::linear_scale(0, drive.truth.time_s.back()),
                       drawing::decade_scale(0.1, largest * 1.01),
                       "time [s]",
                       "horizontal error [m]"};
    plot.draw_ground(canvas);
    for (const Event& event : drive.events) {
      const double left = plot.at(event.start_s, 1).x, right = plot.at(event.end_s, 1).x;
      canvas.rectangle({left, 12, std::max(1.0, right - left), 240}, event.kind == "street"
                                                                         ? drawing::Colour{0.93, 0.91, 0.84}
                                                                         : drawing::Colour{0.97, 0.85, 0.83});
      if (event.kind != "street") canvas.text({left + 3, 24}, event.kind, {10});
    }
    for (std::size_t k = 0; k < errors.size(); ++k)
      draw_line(canvas, plot, drive.truth.time_s, errors[k], stroke_of(k));
    plot.draw_frame(canvas);
  });
}

/// Errors over the reported bound (Stanford diagram): points above the line mislead.
std::string stanford_picture(const DriveFolder& drive, const Tracks& tracks, const Errors& all) {
  return picture(380, 300, [&](Canvas& canvas) {
    drawing::Plot plot{{55, 12, 310, 240},
                       drawing::decade_scale(0.1, 1000),
                       drawing::decade_scale(0.1, 1000),
                       "reported bound, 99.99 % [m]",
                       "horizontal error [m]"};
    plot.draw_ground(canvas);
    canvas.polyline({plot.at(0.1, 0.1), plot.at(1000, 1000)}, {drawing::kInk, 1, {4, 3}});
    std::size_t k = 0;
    for (const auto& [name, track] : tracks) {
      std::size_t next = 0;
      const std::vector<double>& errors = all[k];
      for (std::size_t i = 0; i < errors.size(); ++i) {
        while (next + 1 < track.time_s.size() && track.time_s[next + 1] <= drive.truth.time_s[i]) ++next;
        if (track.time_s.empty() || !std::isfinite(errors[i]) || !track.covariance[next].allFinite())
          continue;
        const double variance = track.covariance[next].trace() / 2;
        canvas.circle(
            plot.at(std::max(0.1, misleading_bound() * std::sqrt(variance)), std::max(0.1, errors[i])), 1.2,
            kColours.at(k % kColours.size()));
      }
      ++k;
    }
    plot.draw_frame(canvas);
  });
}

std::string row_of(const std::vector<std::string>& cells, const char* tag) {
  std::string text = "<tr>";
  for (const std::string& cell : cells) text += fmt::format("<{0}>{1}</{0}>", tag, xml_escaped(cell));
  return text + "</tr>\n";
}

}  // namespace

std::vector<std::string> result_head() {
  return {"drive",   "estimate", "p50 m",    "p95 m",   "largest m",  "RMSE m",   "RPE 10 s m", "there %",
          "< 2 m %", "< 5 m %",  "< 10 m %", "in 95 %", "misleads %", "followed", "recovery s", "diverged s"};
}

std::vector<std::string> result_cells(const Result& result) {
  const Score& s = result.score;
  const auto number = [](const std::optional<double>& value, double factor, int decimals) {
    return value && std::isfinite(*value) ? fmt::format("{:.{}f}", factor * *value, decimals)
                                          : std::string("-");
  };
  std::optional<double> followed, recovery;
  std::string state;  // of events that are not scored
  bool never = false;
  for (const EventScore& event : s.events) {
    if (event.event.kind == "street" || event.state == EventState::NotRead) continue;
    if (event.state == EventState::Absent && state.empty() && s.availability > 0) state = "absent";
    if (event.state == EventState::Lost) state = "lost";
    if (event.followed) followed = std::max(followed.value_or(-1e9), *event.followed);
    if (event.recovery_s) recovery = std::max(recovery.value_or(0), *event.recovery_s);
    never = never || (event.over && !event.recovery_s);
  }
  std::vector<std::string> cells{result.drive,
                                 result.estimate,
                                 number(s.p50_m, 1, 2),
                                 number(s.p95_m, 1, 2),
                                 number(s.largest_m, 1, 1),
                                 number(s.rmse_m, 1, 2),
                                 number(s.rpe_10s_m, 1, 2),
                                 number(s.availability, 100, 0)};
  for (const double fraction : s.within) cells.push_back(number(fraction, 100, 0));
  for (const std::string& cell :
       {number(s.within_95, 100, 0), number(s.misleading, 100, 1),
        followed || state.empty() ? number(followed, 1, 2) : state,
        never ? std::string("never") : number(recovery, 1, 1), number(s.longest_divergence_s, 1, 1)})
    cells.push_back(cell);
  return cells;
}

std::string page(const std::vector<Result>& results, const std::vector<DriveFolder>& drives,
                 const std::map<std::string, Tracks>& tracks) {
  std::string text =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>canyon bench</title>\n<style>body{font:14px "
      "sans-serif;margin:1.5em;"
      "max-width:1280px}table{border-collapse:collapse}td,th{padding:2px "
      "8px;text-align:right;border-bottom:1px solid "
      "#ddd}td:nth-child(-n+2),th:nth-child(-n+2){text-align:left}.bad{color:#b00}img{max-width:100%;height:"
      "auto}"
      "div.wide{overflow-x:auto}</style></head><body>\n<h1>canyon bench</h1>\n<div class=\"wide\"><table>\n";
  text += row_of(result_head(), "th");
  for (const Result& each : results) text += row_of(result_cells(each), "td");
  text += "</table></div>\n";
  for (const Result& each : results)
    for (const std::string& violation : each.violations)
      text += fmt::format("<p class=\"bad\">{}, {}: {}</p>\n", xml_escaped(each.drive),
                          xml_escaped(each.estimate), xml_escaped(violation));
  for (const DriveFolder& drive : drives) {
    const Tracks& its = tracks.at(drive.name);
    text += fmt::format("<h2>{}</h2>\n<p><b>truth</b>", xml_escaped(drive.name));
    std::size_t k = 0;
    for (const auto& [name, track] : its) {
      const drawing::Colour& c = kColours.at(k++ % kColours.size());
      text += fmt::format(" <b style=\"color:rgb({:.0f},{:.0f},{:.0f})\">{}</b>", 255 * c.r, 255 * c.g,
                          255 * c.b, xml_escaped(name));
    }
    text += "</p>\n";
    Errors errors;
    for (const auto& [name, track] : its) errors.push_back(errors_over_time(drive, track));
    text += map_picture(drive, its) + error_picture(drive, errors) + stanford_picture(drive, its, errors);
  }
  return text + "</body></html>\n";
}

}  // namespace canyon::bench
