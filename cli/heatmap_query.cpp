#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/analysis/heatmap/engine/map_summary.hpp"
#include "canyon/analysis/heatmap/engine/route_report.hpp"
#include "canyon/analysis/heatmap/files/stored_map.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/text.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"
#include "cli/commands.hpp"
#include "cli/field_option.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {
namespace {

using Eigen::Vector2d;
using geodesy::GpsTime;
using heatmap::CellState;
using heatmap::RouteReport;
using heatmap::StoredMap;

struct HeatmapQueryArguments {
  std::string map, position, path, format, time;  ///< format: empty: detected from the route's content
  heatmap::RouteOptions route;                    ///< step_m: 0: not given
  bool json = false;
};

std::string state_word(CellState state) {
  static constexpr std::array kWords{"computed", "inside a building", "under the terrain",
                                     "outside the map's area", "without terrain"};
  return kWords.at(static_cast<std::size_t>(state));
}

/// Three significant digits below a thousand: "7.38", "0.953", "1234".
std::string metric(double value) {
  if (std::isnan(value)) return "-";
  const double size = std::abs(value);
  return fmt::format("{:.{}f}", value, size >= 999.5 ? 0 : size >= 99.95 ? 1 : size >= 0.9995 ? 2 : 3);
}
std::string altitude_text(const StoredMap& map, double altitude_m) {
  return fmt::format("{:g} m above the {}", altitude_m,
                     map.altitude_kind() == heatmap::AltitudeKind::Ellipsoid ? "ellipsoid" : "terrain");
}
std::string altitudes_text(const StoredMap& map) {
  const std::vector<double>& altitudes = map.altitudes_m();
  return altitudes.size() == 1
             ? altitude_text(map, altitudes.front())
             : fmt::format("{:g} to {}", altitudes.front(), altitude_text(map, altitudes.back()));
}
std::string times_text(const StoredMap& map) {
  const std::vector<GpsTime>& times = map.times();
  if (times.size() == 1) return "of " + geodesy::format_utc(times.front(), 0);
  return fmt::format("from {} to {}", geodesy::format_utc(times.front(), 0),
                     geodesy::format_utc(times.back(), 0));
}
std::string bounds_text(const StoredMap& map) {
  const heatmap::Grid& grid = map.grid();
  const auto corner = [&](double east, double north) {
    const geodesy::Geodetic position = map.frame().geodetic_from_local({east, north, 0});
    return fmt::format("{:.6f},{:.6f}", geodesy::degrees(position.latitude_rad),
                       geodesy::degrees(position.longitude_rad));
  };
  return fmt::format("{} to {}", corner(grid.west_m, grid.south_m), corner(grid.east_m(), grid.north_m()));
}

/// A map has values beyond its lowest and highest altitude up to half a step, at most this far [m].
constexpr double kAltitudeReach_m = 5;
/// Two altitudes closer than this count as equal [m].
constexpr double kSameAltitude_m = 0.1;

/// The altitude of --altitude, else the map's lowest. Warns if another one is used.
double altitude_of(const HeatmapQueryArguments& arguments, const StoredMap& map) {
  if (!arguments.route.altitude_m) return map.altitudes_m().front();
  const double requested_m = *arguments.route.altitude_m;
  const std::vector<double>& known = map.altitudes_m();
  const auto nearest = std::min_element(known.begin(), known.end(), [requested_m](double a, double b) {
    return std::abs(a - requested_m) < std::abs(b - requested_m);
  });
  // Between altitudes the nearest one is used; beyond them, only if it is close.
  const bool between = requested_m >= known.front() && requested_m <= known.back();
  double reach_m = kAltitudeReach_m;
  if (known.size() > 1) {
    const double step_m =
        requested_m < known.front() ? known[1] - known[0] : known.back() - known[known.size() - 2];
    reach_m = std::min(reach_m, 0.5 * step_m);
  }
  if (!between && std::abs(*nearest - requested_m) > reach_m) {
    throw InputError(
        fmt::format("--altitude {:g}: the map's nearest is {}", requested_m, altitude_text(map, *nearest)),
        fmt::format("compute one there: canyon heatmap ... --altitude {:g}", requested_m));
  }
  if (std::abs(*nearest - requested_m) > kSameAltitude_m) {
    print_warnings({fmt::format("the map has no altitude of {:g} m: using the nearest, {}", requested_m,
                                altitude_text(map, *nearest))});
  }
  return requested_m;
}

int query_point(const HeatmapQueryArguments& arguments, const StoredMap& map) {
  const std::vector<double> at = parse_numbers(arguments.position);
  if (at.size() != 2) {
    throw InputError(fmt::format("--at '{}' is not a position on a map", arguments.position),
                     "give LATITUDE,LONGITUDE in degrees, and --altitude if the map has several");
  }
  const auto position = geodesy::Geodetic::from_degrees(at[0], at[1], map.frame().origin().height_m);
  geodesy::check_geodetic(position, "--at");
  const Vector2d enu = map.frame().local_from_geodetic(position).head<2>();
  const GpsTime time = arguments.time.empty() ? map.times().front() : parse_instant(arguments.time);
  const std::optional<heatmap::MapSample> result = map.at(enu, altitude_of(arguments, map), time);
  if (!result) {
    if (map.at({map.grid().centre(0, 0)}, map.altitudes_m().front(), time)) {
      throw InputError(fmt::format("--at {} is outside the map", arguments.position),
                       "it extends from " + bounds_text(map));
    }
    throw InputError(fmt::format("--time {} is outside the map's times", geodesy::format_utc(time, 0)),
                     "the map is " + times_text(map));
  }
  if (arguments.json) {
    Json out{{"latitude_deg", geodesy::degrees(position.latitude_rad)},
             {"longitude_deg", geodesy::degrees(position.longitude_rad)},
             {"enu_m", {enu.x(), enu.y()}},
             {"altitude_m", result->altitude_m},
             {"motion", map.motion()},
             {"time_utc", geodesy::format_utc(result->time)},
             {"state", state_word(result->state)},
             {"values", Json::object()}};
    for (std::size_t k = 0; k < map.layers().size(); ++k)
      out["values"][std::string(heatmap::info(map.layers()[k]).name)] = result->values[k];
    fmt::print("{}\n", out.dump(2, Json::Order::ByKey));
    return kOk;
  }
  fmt::print("{:.7f}, {:.7f} (east {:.2f}, north {:.2f} m), {}, {}, receiver {}: {}\n\n",
             geodesy::degrees(position.latitude_rad), geodesy::degrees(position.longitude_rad), enu.x(),
             enu.y(), altitude_text(map, result->altitude_m), geodesy::format_utc(result->time, 0),
             map.motion(), state_word(result->state));
  std::vector<TextRow> rows;
  for (std::size_t k = 0; k < map.layers().size(); ++k) {
    const heatmap::LayerInfo& about = heatmap::info(map.layers()[k]);
    rows.push_back({std::string(about.name), metric(result->values[k]), std::string(about.unit)});
  }
  print_table({"layer", "value", "unit"}, rows);
  return kOk;
}

RouteReport report_of(const HeatmapQueryArguments& arguments, const StoredMap& map) {
  heatmap::RouteOptions options = arguments.route;
  // A map above terrain has no heights above the ellipsoid, but a route does.
  const bool flat = options.altitude_m || map.altitude_kind() == heatmap::AltitudeKind::AboveTerrain;
  // Relative times are relative to the map's first one.
  const GpsTime first = map.times().front();
  simulation::RecordedPath path =
      simulation::read_recorded_path(arguments.path, arguments.format, first, {!flat, 0});
  if (!path.timed && !options.speed_mps)
    throw InputError(arguments.path, 0, "the path has no times", "give --speed");
  for (std::size_t i = 0; !path.timed && i < path.points.size(); ++i)  // replaced by --speed
    path.points[i].time = first + static_cast<double>(i);
  const simulation::TrajectoryFile route = simulation::recorded_trajectory(std::move(path));
  print_report(route.report, "canyon check " + arguments.path);
  if (options.step_m == 0) options.step_m = 0.5 * map.grid().spacing_m;
  if (!arguments.time.empty()) options.start = parse_instant(arguments.time);
  if (flat) options.altitude_m = altitude_of(arguments, map);
  return heatmap::report_route(
      [&map](const Vector2d& enu, double altitude_m, GpsTime time) { return map.at(enu, altitude_m, time); },
      map.frame(), map.layers(), route.trajectory, options);
}

std::string stretch_text(const heatmap::RouteStretch& stretch, const RouteReport& report,
                         const StoredMap& map) {
  const heatmap::RouteStation& middle = report.stations[stretch.first + stretch.count / 2];
  const geodesy::Geodetic position = map.frame().geodetic_from_local({middle.enu.x(), middle.enu.y(), 0});
  return fmt::format("{:.0f} to {:.0f} m, about {:.6f}, {:.6f}", stretch.from_m, stretch.to_m,
                     geodesy::degrees(position.latitude_rad), geodesy::degrees(position.longitude_rad));
}

/// "1234 m in 3 min 5 s: 7.4 m of horizontal_error_mean in the mean, a fix on 97.2 % of it, worst 31.0 m at
/// 410 to 460 m".
std::string one_line(const RouteReport& report) {
  std::string text = fmt::format("{:.0f} m in {}:", report.length_m, duration_text(report.duration_s));
  if (report.known == 0) return text + " no values on it";
  const char* comma = " ";
  if (report.error && report.layers[*report.error].values > 0) {
    text += fmt::format("{}{} m of {} in the mean", comma, metric(report.layers[*report.error].mean),
                        heatmap::info(report.layers[*report.error].layer).name);
    comma = ", ";
  }
  if (report.availability) {
    text += fmt::format("{}a fix on {:.1f} %", comma, 100 * *report.availability);
    comma = ", ";
  }
  if (report.worst) {
    text += fmt::format("{}worst {} m at {:.0f} to {:.0f} m", comma, metric(*report.worst_error_m),
                        report.worst->from_m, report.worst->to_m);
    comma = ", ";
  }
  if (report.known < report.stations.size()) {
    text += fmt::format(
        "{}{:.1f} % of it without values", comma,
        100 * (1 - static_cast<double>(report.known) / static_cast<double>(report.stations.size())));
  }
  return text;
}

Json stretch_json(const std::optional<heatmap::RouteStretch>& stretch) {
  if (!stretch) return {};
  return {{"from_m", stretch->from_m}, {"to_m", stretch->to_m}};
}

void print_json(const RouteReport& report, const StoredMap& map) {
  Json out{{"motion", map.motion()},
           {"length_m", report.length_m},
           {"duration_s", report.duration_s},
           {"summary", one_line(report)},
           {"stations_known", report.known},
           {"stations_outside", report.outside},
           {"stations_without_answer", report.no_answer},
           {"availability", report.availability},
           {"expected_error_layer", nullptr},
           {"expected_error_m", nullptr},
           {"worst_stretch", stretch_json(report.worst)},
           {"longest_without_fix", stretch_json(report.no_fix)},
           {"layers", Json::object()},
           {"stations", Json::array()}};
  if (report.worst) out["worst_stretch"]["error_m"] = *report.worst_error_m;
  if (report.error) {
    const heatmap::LayerSummary& error = report.layers[*report.error];
    out["expected_error_layer"] = std::string(heatmap::info(error.layer).name);
    out["expected_error_m"] = error.mean;
  }
  for (const heatmap::LayerSummary& layer : report.layers) {
    out["layers"][std::string(heatmap::info(layer.layer).name)] = {
        {"stations", layer.values}, {"mean", layer.mean},   {"median", layer.median},
        {"p95", layer.p95},         {"least", layer.least}, {"greatest", layer.greatest}};
  }
  for (const heatmap::RouteStation& station : report.stations) {
    const geodesy::Geodetic position = map.frame().geodetic_from_local({station.enu.x(), station.enu.y(), 0});
    Json entry{{"way_m", station.travelled_m},
               {"latitude_deg", geodesy::degrees(position.latitude_rad)},
               {"longitude_deg", geodesy::degrees(position.longitude_rad)},
               {"time_utc", geodesy::format_utc(station.time)},
               {"state", station.result ? state_word(station.result->state) : "outside the map"}};
    if (station.result)
      for (std::size_t k = 0; k < map.layers().size(); ++k)
        entry[std::string(heatmap::info(map.layers()[k]).name)] = station.result->values[k];
    out["stations"].push_back(std::move(entry));
  }
  fmt::print("{}\n", out.dump(2, Json::Order::ByKey));
}

int query_path(const HeatmapQueryArguments& arguments, const StoredMap& map) {
  const RouteReport report = report_of(arguments, map);
  if (report.outside == report.stations.size()) {
    throw InputError(fmt::format("{} is entirely outside the map or its times", arguments.path),
                     fmt::format("the map extends from {} and is {}; --time shifts the route's start",
                                 bounds_text(map), times_text(map)));
  }
  if (arguments.json) {
    print_json(report, map);
    return kOk;
  }
  const auto fraction = [&](std::size_t count) {
    return fmt::format("{:.1f} %",
                       100 * static_cast<double>(count) / static_cast<double>(report.stations.size()));
  };
  std::vector<TextRow> rows;
  for (const heatmap::LayerSummary& layer : report.layers) {
    const heatmap::LayerInfo& about = heatmap::info(layer.layer);
    rows.push_back({std::string(about.name), std::string(about.unit), metric(layer.mean),
                    metric(layer.median), metric(layer.p95), metric(layer.greatest)});
  }
  print_table({"along the route", "unit", "mean", "median", "95 %", "greatest"}, rows);
  fmt::print("\nmap                  {}, {}, receiver {}\n", altitudes_text(map), times_text(map),
             map.motion());
  if (report.worst) {
    fmt::print("worst segment        {} m at {}\n", metric(*report.worst_error_m),
               stretch_text(*report.worst, report, map));
  }
  if (report.no_fix) fmt::print("longest without fix  {}\n", stretch_text(*report.no_fix, report, map));
  if (report.no_answer > 0) {
    fmt::print("not computed         {} (inside buildings, under terrain, outside the area)\n",
               fraction(report.no_answer));
  }
  if (report.outside > 0) fmt::print("outside the map      {}\n", fraction(report.outside));
  fmt::print("{}\n", one_line(report));
  return kOk;
}

int run_heatmap_query(const HeatmapQueryArguments& arguments) {
  if (arguments.position.empty() == arguments.path.empty())
    throw InputError("neither a position nor a route is given", "give --at LAT,LON or --path FILE");
  if (!arguments.format.empty()) check_trajectory_format(arguments.format);
  const StoredMap map(arguments.map);
  return arguments.position.empty() ? query_path(arguments, map) : query_point(arguments, map);
}

constexpr const char* kHeatmapQueryFooter =
    R"(Expected error: the map's horizontal_error_mean, else _rms, _p50 or horizontal_error, averaged over the route.
Values are those of the cell and of the nearest altitude and time. If the map's altitudes are above the terrain,
a route takes the map's altitude instead of its own.

Examples:
  canyon heatmap query out/map/map.nc --at 22.3012,114.1745
  canyon heatmap query out/day/map.nc --path route.csv --speed 12 --time 2026-06-01T08:30:00Z
  canyon heatmap query out/day/map.nc --path drive.nmea --json)";

}  // namespace

void add_heatmap_query(Command& heatmap) {
  Command& command =
      heatmap.add_command("query", "print the values of a finished map at a position or along a route");
  HeatmapQueryArguments& arguments = command.run_with(run_heatmap_query);
  command.add_option("map", arguments.map, "MAP.nc", "the map's NetCDF file").required();
  command.add_option("--at", arguments.position, "LAT,LON", "a position [deg]");
  command
      .add_option("--path", arguments.path, "FILE", "a route: positions, and times unless --speed is given")
      .excludes("--at");
  command
      .add_option("--format", arguments.format, "FORMAT",
                  fmt::format("format of the route: {} (detected from its content, else csv)",
                              fmt::join(simulation::trajectory_formats(), ", ")))
      .needs("--path");
  arguments.route.step_m = 0;
  add_field(command, "--altitude", arguments.route, "altitude_m");
  command.add_option("--time", arguments.time, "T",
                     "time in UTC, or followed by ' GPST'; with --path: time of its beginning (the map's "
                     "first; the route's)");
  add_field(command, "--speed", arguments.route, "speed_mps").needs("--path");
  add_field(command, "--stretch", arguments.route, "stretch_m").needs("--path");
  add_field(command, "--step", arguments.route, "step_m").needs("--path");
  command.add_flag("--json", arguments.json, "print JSON, with all stations");
  command.footer = kHeatmapQueryFooter;
}

}  // namespace canyon::cli
