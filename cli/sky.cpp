#include <fmt/format.h>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/json.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "cli/commands.hpp"
#include "cli/field_option.hpp"

namespace canyon::cli {
namespace {

struct SkyArguments {
  simulation::SkyConfig sky;
  std::string position;
  std::string time;
  double mask_deg = 0;
  bool all = false;
  bool json = false;
};

struct Row {
  gnss::SatelliteId id;
  std::optional<orbit::LineOfSight> line;
  std::string source;
  bool above_mask = false;
};

Json row_json(const Row& row) {
  Json json{{"sat", gnss::to_string(row.id)}, {"above_mask", row.above_mask}, {"source", row.source}};
  if (!row.line) return json;
  const Eigen::Vector3d& p = row.line->state.position_m;
  json["azimuth_deg"] = geodesy::degrees(row.line->azimuth_rad);
  json["elevation_deg"] = geodesy::degrees(row.line->elevation_rad);
  json["range_m"] = row.line->range_m;
  json["position_ecef_m"] = {p.x(), p.y(), p.z()};
  json["clock_bias_s"] = row.line->state.clock_bias_s;
  return json;
}

int run_sky(const SkyArguments& arguments) {
  const geodesy::Geodetic position = parse_position(arguments.position, "--at");
  const geodesy::GpsTime time = parse_instant(arguments.time);
  if (!(arguments.mask_deg >= -90 && arguments.mask_deg < 90)) {
    throw InputError(fmt::format("--mask {} is not an elevation", arguments.mask_deg),
                     "give -90 to 90 degrees");
  }
  const simulation::BuiltSky sky = simulation::build_sky(arguments.sky, time, time, position);
  print_report(sky.report, "canyon check of the sky's files");

  const Eigen::Vector3d antenna = geodesy::ecef_from_geodetic(position);
  std::vector<Row> up, down, absent;
  for (const gnss::SatelliteId id : sky.sky->satellites()) {
    Row row{id, orbit::line_of_sight(*sky.sky, id, time, antenna), sky.sky->source(id, time)};
    row.above_mask = row.line.has_value() && geodesy::degrees(row.line->elevation_rad) >= arguments.mask_deg;
    (row.above_mask ? up : row.line ? down : absent).push_back(std::move(row));
  }
  std::vector<Row> shown = up;
  if (arguments.all)
    for (const auto* more : {&down, &absent}) shown.insert(shown.end(), more->begin(), more->end());
  if (arguments.json) {
    Json out{{"time_gpst", geodesy::format_gpst(time)},
             {"time_utc", geodesy::format_utc(time)},
             {"latitude_deg", geodesy::degrees(position.latitude_rad)},
             {"longitude_deg", geodesy::degrees(position.longitude_rad)},
             {"height_m", position.height_m},
             {"satellites", Json::array()},
             {"warnings", sky.report.warnings()},
             {"report", report_json(sky.report)}};
    for (const Row& row : shown) out["satellites"].push_back(row_json(row));
    fmt::print("{}\n", out.dump(2, Json::Order::ByKey));
    return kOk;
  }

  fmt::print("{} ({}) at {:.6f}, {:.6f}, {:.1f} m\n\n", geodesy::format_gpst(time, 0),
             geodesy::format_utc(time, 0), geodesy::degrees(position.latitude_rad),
             geodesy::degrees(position.longitude_rad), position.height_m);
  std::vector<TextRow> rows;
  for (const Row& row : shown) {
    const auto cell = [&row](double value) { return row.line ? fmt::format("{:.1f}", value) : "-"; };
    const orbit::LineOfSight line = row.line.value_or(orbit::LineOfSight());
    rows.push_back({gnss::to_string(row.id), cell(geodesy::degrees(line.azimuth_rad)),
                    cell(geodesy::degrees(line.elevation_rad)), cell(line.range_m / 1e3), row.source});
  }
  print_table({"sat", "azimuth [deg]", "elevation [deg]", "range [km]", "source"}, rows);
  fmt::print("\n{} satellites above {} deg, {} below, {} without a valid ephemeris{}\n", up.size(),
             arguments.mask_deg, down.size(), absent.size(),
             arguments.all || down.size() + absent.size() == 0 ? "" : " (--all lists them)");
  return kOk;
}

}  // namespace

void add_sky(Command& app) {
  Command& command = app.add_command("sky", "list the satellites above a position, with their ephemerides");
  SkyArguments& arguments = command.run_with(run_sky);
  arguments.sky.nominal = true;
  add_field(command, "--nav", arguments.sky, "navigation", "the nominal constellations");
  add_field(command, "--sp3", arguments.sky, "sp3").excludes("--nav");
  command
      .add_option("--at", arguments.position, "LAT,LON,HEIGHT",
                  "position: latitude and longitude in degrees, ellipsoidal height in metres")
      .required();
  command
      .add_option("--time", arguments.time, "T", "time: 2019-04-28T12:58:03Z (UTC), or followed by ' GPST'")
      .required();
  add_field(command, "--systems", arguments.sky, "systems");
  command.add_option("--mask", arguments.mask_deg, "DEG", "lowest elevation shown [deg] (0)");
  add_field(command, "--allow-stale", arguments.sky, "allow_stale", nullptr, true);
  command.add_flag("--all", arguments.all, "also list satellites below the mask or without ephemerides");
  command.add_flag("--json", arguments.json, "print JSON");
}

}  // namespace canyon::cli
