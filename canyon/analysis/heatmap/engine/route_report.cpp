#include "canyon/analysis/heatmap/engine/route_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector2d;
using geodesy::GpsTime;

constexpr double kChord_s = 0.25;
constexpr double kMaxChords = 2e6, kMaxStations = 1e7;

/// The route as a polyline, with the trajectory's times and heights at its corners.
struct Route {
  struct Corner {
    double travelled_m = 0, seconds = 0, height_m = 0;
    Vector2d enu;
  };
  std::vector<Corner> corners;
  [[nodiscard]] double length_m() const { return corners.back().travelled_m; }

  /// @param travelled_m ascending from call to call @param hint kept by the caller, 0 at first
  [[nodiscard]] Corner at(double travelled_m, std::size_t& hint) const {
    while (hint + 2 < corners.size() && corners[hint + 1].travelled_m < travelled_m) ++hint;
    if (corners.size() == 1) return corners.front();
    const Corner &a = corners[hint], &b = corners[hint + 1];
    const double length = b.travelled_m - a.travelled_m;
    const double fraction = length > 0 ? std::clamp((travelled_m - a.travelled_m) / length, 0.0, 1.0) : 0;
    return {travelled_m, a.seconds + fraction * (b.seconds - a.seconds),
            a.height_m + fraction * (b.height_m - a.height_m), a.enu + fraction * (b.enu - a.enu)};
  }
};

Route follow(const simulation::Trajectory& trajectory, const geodesy::LocalFrame& frame) {
  const double duration_s = trajectory.end() - trajectory.begin();
  const double step_s = std::min(kChord_s, trajectory.sample_interval_s() / 4);
  const double steps = std::clamp(std::ceil(duration_s / step_s), 1.0, kMaxChords);
  Route route;
  for (std::size_t i = 0; i <= static_cast<std::size_t>(steps); ++i) {
    const double seconds = duration_s * static_cast<double>(i) / steps;
    const geodesy::Geodetic geodetic = trajectory.at(trajectory.begin() + seconds).position;
    const Vector2d enu = frame.local_from_geodetic(geodetic).head<2>();
    const double gone = route.corners.empty() ? 0 : (enu - route.corners.back().enu).norm();
    const double before = route.corners.empty() ? 0 : route.corners.back().travelled_m;
    route.corners.push_back({before + gone, seconds, geodetic.height_m, enu});
  }
  return route;
}

bool known(const RouteStation& station) {
  return station.result && station.result->state == CellState::Computed;
}

LayerSummary summarize_layer(Layer layer, std::size_t index, const std::vector<RouteStation>& stations) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> values;
  double sum = 0;
  for (const RouteStation& station : stations) {
    if (!known(station) || std::isnan(station.result->values[index])) continue;
    values.push_back(station.result->values[index]);
    sum += values.back();
  }
  LayerSummary result{layer, values.size(), kNone, kNone, kNone, kNone, kNone};
  if (values.empty()) return result;
  std::sort(values.begin(), values.end());
  result.mean = sum / static_cast<double>(values.size());
  result.median = *quantile(values, 0.5);
  result.p95 = *quantile(values, 0.95);
  result.least = values.front();
  result.greatest = values.back();
  return result;
}

std::optional<std::size_t> error_layer(const std::vector<Layer>& layers) {
  for (const Layer wanted : {Layer::HorizontalErrorMean, Layer::HorizontalErrorRms, Layer::HorizontalErrorP50,
                             Layer::HorizontalError, Layer::HorizontalErrorP95}) {
    const auto found = std::find(layers.begin(), layers.end(), wanted);
    if (found != layers.end()) return static_cast<std::size_t>(found - layers.begin());
  }
  return std::nullopt;
}

RouteStretch stretch(std::size_t first, std::size_t count, double piece_m) {
  return {static_cast<double>(first) * piece_m, static_cast<double>(first + count) * piece_m, first, count};
}

void find_worst(RouteReport& report, double piece_m, double stretch_m) {
  const std::vector<RouteStation>& stations = report.stations;
  // A segment of this many stations is at least as long as `stretch_m`, if the route is.
  const std::size_t window =
      piece_m > 0 ? std::clamp<std::size_t>(static_cast<std::size_t>(std::ceil(stretch_m / piece_m - 1e-9)),
                                            1, stations.size())
                  : stations.size();
  const auto error = [&](std::size_t i) {
    return known(stations[i]) ? static_cast<double>(stations[i].result->values[*report.error])
                              : std::numeric_limits<double>::quiet_NaN();
  };
  // Prefix sums, so that rounding errors do not accumulate as the window slides.
  std::vector<double> sums{0};
  std::vector<std::size_t> counts{0};
  for (std::size_t i = 0; i < stations.size(); ++i) {
    const double e = error(i);
    sums.push_back(sums.back() + (std::isnan(e) ? 0 : e));
    counts.push_back(counts.back() + (std::isnan(e) ? 0 : 1));
  }
  for (std::size_t first = 0; first + window <= stations.size(); ++first) {
    const std::size_t values = counts[first + window] - counts[first];
    if (values == 0 || 2 * values < window) continue;
    const double mean = (sums[first + window] - sums[first]) / static_cast<double>(values);
    if (report.worst_error_m && mean <= *report.worst_error_m) continue;
    report.worst_error_m = mean;
    report.worst = stretch(first, window, piece_m);
  }
}

void find_no_fix(RouteReport& report, const std::vector<Layer>& layers, std::size_t layer, double piece_m) {
  double sum = 0;
  std::size_t length = 0;
  for (std::size_t i = 0; i < report.stations.size(); ++i) {
    const RouteStation& station = report.stations[i];
    const bool here = known(station);
    const double fraction = here ? fix_fraction(layers[layer], station.result->values[layer]) : 0;
    if (here) sum += fraction;
    length = here && fraction < 0.5 ? length + 1 : 0;
    if (length > 0 && (!report.no_fix || length > report.no_fix->count))
      report.no_fix = stretch(i + 1 - length, length, piece_m);
  }
  if (report.known > 0) report.availability = sum / static_cast<double>(report.known);
}

}  // namespace

void RouteOptions::validate() const {
  options::check(*this, "route");
}

void visit(options::Visitor& v, RouteOptions& o) {
  v.number({"step_m", "m", "distance between stations", "half a cell"}, o.step_m, {0, 1e6, true});
  v.number({"stretch_m", "m", "length of the worst segment"}, o.stretch_m, {0, 1e6, true});
  v.number({"speed_mps", "m/s", "speed along the route, instead of the route's times"}, o.speed_mps,
           {0, 1e5, true});
  v.number({"altitude_m", "m", "altitude as the map defines it",
            "the map's lowest; the route's own, if the map's altitudes are ellipsoidal"},
           o.altitude_m, {});
}

RouteReport report_route(const MapLookup& map, const geodesy::LocalFrame& frame,
                         const std::vector<Layer>& layers, const simulation::Trajectory& trajectory,
                         const RouteOptions& options) {
  options.validate();
  const Route route = follow(trajectory, frame);
  RouteReport report;
  report.length_m = route.length_m();
  const double pieces = std::max(1.0, std::ceil(report.length_m / options.step_m - 1e-9));
  if (pieces > kMaxStations) {
    throw InputError(fmt::format("a route of {:.0f} m in steps of {} m has {:.0f} stations", report.length_m,
                                 options.step_m, pieces),
                     fmt::format("use a longer step: at most {:.0f} are evaluated", kMaxStations));
  }
  const double piece_m = report.length_m / pieces;
  const GpsTime start = options.start.value_or(trajectory.begin());
  report.duration_s = options.speed_mps ? report.length_m / *options.speed_mps
                                        : static_cast<double>(trajectory.end() - trajectory.begin());
  std::size_t hint = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(pieces); ++i) {
    const Route::Corner here = route.at((static_cast<double>(i) + 0.5) * piece_m, hint);
    const double seconds = options.speed_mps ? here.travelled_m / *options.speed_mps : here.seconds;
    RouteStation station{here.travelled_m, start + seconds, here.enu, std::nullopt};
    station.result = map(station.enu, options.altitude_m.value_or(here.height_m), station.time);
    assert(!station.result || station.result->values.size() == layers.size());
    if (!station.result)
      ++report.outside;
    else if (known(station))
      ++report.known;
    else
      ++report.no_answer;
    report.stations.push_back(std::move(station));
  }
  for (std::size_t k = 0; k < layers.size(); ++k)
    report.layers.push_back(summarize_layer(layers[k], k, report.stations));
  report.error = error_layer(layers);
  if (report.error) find_worst(report, piece_m, options.stretch_m);
  if (const auto shown = fix_layer(layers)) find_no_fix(report, layers, *shown, piece_m);
  return report;
}

}  // namespace canyon::heatmap
