// Declared in cli/city_commands.hpp.
#include <fmt/format.h>

#include <chrono>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario.hpp"
#include "cli/city_commands.hpp"
#include "cli/commands.hpp"
#include "cli/field_option.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {
namespace {

struct CityInfoArguments {
  std::string input;
  std::string origin;
  buildings::ModelOptions model;
  buildings::TerrainOptions sea_level;
  bool json = false;
  TileArguments tiles;
};

int run_city_info(const CityInfoArguments& arguments) {
  simulation::CityConfig config = city_config(arguments.input, arguments.origin);
  set_model(config, arguments.model);
  if (arguments.sea_level.geoid_undulation_m || arguments.sea_level.geoid != buildings::GeoidModel::ByFile)
    config.sea_level = arguments.sea_level;
  change_tiles(config, arguments.tiles, arguments.input);
  const auto begin = std::chrono::steady_clock::now();
  const buildings::BuiltCity loaded = load_city(config, "building the city", arguments.json);
  print_warnings(loaded.report.cautions);
  const city::City& city = loaded.city;
  const double load_s = seconds_since(begin);
  const city::CitySummary summary = city::summarize(city);
  const geodesy::Geodetic& origin = city.frame.origin();
  const bool empty = summary.triangles == 0;
  const Eigen::Vector3d low = empty ? Eigen::Vector3d::Zero().eval() : summary.bounds.min;
  const Eigen::Vector3d high = empty ? Eigen::Vector3d::Zero().eval() : summary.bounds.max;

  if (arguments.json) {
    const Json out{{"name", city.name},
                   {"origin",
                    {{"latitude_deg", geodesy::degrees(origin.latitude_rad)},
                     {"longitude_deg", geodesy::degrees(origin.longitude_rad)},
                     {"height_m", origin.height_m}}},
                   {"buildings", summary.buildings},
                   {"triangles", summary.triangles},
                   {"terrain_triangles", summary.terrain_triangles},
                   {"bounds_min_m", {low.x(), low.y(), low.z()}},
                   {"bounds_max_m", {high.x(), high.y(), high.z()}},
                   {"highest_roof_m", summary.highest_roof_m},
                   {"built_area_fraction", summary.built_area_fraction},
                   {"notes", city.notes},
                   {"load_s", load_s}};
    fmt::print("{}\n", out.dump(2, Json::Order::ByKey));
    return kOk;
  }
  fmt::print("{}\n", city.name);
  const bool placed =
      (!config.mesh && loaded.placed) || !arguments.origin.empty() || is_scenario(arguments.input);
  if (placed) {
    fmt::print("  origin        {:.6f}, {:.6f}, {:.1f} m\n", geodesy::degrees(origin.latitude_rad),
               geodesy::degrees(origin.longitude_rad), origin.height_m);
  } else {
    fmt::print("  origin        not known ({} has none; --origin, or city.origin in a scenario)\n",
               config.mesh ? "a mesh" : "this tileset");
  }
  fmt::print("  buildings     {}\n", summary.buildings);
  fmt::print("  triangles     {} ({} terrain)\n", summary.triangles, summary.terrain_triangles);
  fmt::print("  extent        {:.0f} m east-west, {:.0f} m north-south, {:.1f} to {:.1f} m high\n",
             high.x() - low.x(), high.y() - low.y(), low.z(), high.z());
  fmt::print("  east, north   {:.1f} to {:.1f} m, {:.1f} to {:.1f} m from the origin\n", low.x(), high.x(),
             low.y(), high.y());
  fmt::print("  highest roof  {:.1f} m\n", summary.highest_roof_m);
  fmt::print("  built area    {:.0f} %\n", summary.built_area_fraction * 100);
  fmt::print("  loaded in     {:.2f} s\n", load_s);
  for (const std::string& note : city.notes) fmt::print("  note          {}\n", note);
  return kOk;
}

}  // namespace

void add_model_options(Command& command, buildings::ModelOptions& model) {
  add_field(command, "--lod", model, "lod");
  add_field(command, "--crs", model, "crs");
}

void set_model(simulation::CityConfig& config, const buildings::ModelOptions& model) {
  if (!model.lod && model.crs.empty()) return;
  if (!config.map) throw InputError("--lod and --crs are for city models", "leave them out");
  if (model.lod) config.map->model.lod = model.lod;
  if (!model.crs.empty()) config.map->model.crs = model.crs;
}

simulation::CityConfig city_config(const std::string& input, const std::string& origin) {
  if (is_scenario(input)) {
    if (!origin.empty()) {
      throw InputError("--origin belongs to a mesh or map file", "a scenario has its own origin under city:");
    }
    return simulation::city_config(simulation::read_scenario(input, {false}));
  }
  if (origin.empty()) return simulation::city_config(input);
  return simulation::city_config(input, parse_place(origin, "--origin"));
}

void add_tile_options(Command& command, TileArguments& arguments, bool with_box) {
  add_change(command, "--error", arguments.changes, "error_m");
  if (with_box)
    command.add_option("--bbox", arguments.bbox, "W,S,E,N", "only tiles that touch this box (degrees)");
  add_change(command, "--most-tiles", arguments.changes, "most_tiles");
  add_change(command, "--skin", arguments.changes, "skin");
  add_change(command, "--flatten", arguments.changes, "flatten_m");
  add_switch(command, "--elsewhere", arguments.changes, "elsewhere");
}

void change_tiles(simulation::CityConfig& config, const TileArguments& arguments, const std::string& input) {
  if (arguments.changes.empty() && arguments.bbox.empty()) return;
  if (!config.tiles) {
    throw InputError(
        fmt::format(
            "{} is not 3D Tiles, for which alone --error, --most-tiles, --skin, --flatten, --elsewhere "
            "and the --bbox of this command are",
            tiles::public_address(input)),
        "leave them out");
  }
  make(arguments.changes, *config.tiles);
  if (!arguments.bbox.empty()) config.tiles->bbox_deg = parse_bbox(arguments.bbox, "--bbox");
}

buildings::BuiltCity load_city(const simulation::CityConfig& config, const char* what, bool quiet) {
  Progress progress(what, quiet);
  return simulation::load_city_with_report(config, progress.callback());
}

std::array<double, 4> parse_bbox(const std::string& text, const std::string& option) {
  const std::vector<double> values = parse_numbers(text);
  if (values.size() != 4) {
    throw InputError(fmt::format("{} '{}' is not a box", option, text),
                     "give WEST,SOUTH,EAST,NORTH in degrees, e.g. 114.16,22.29,114.18,22.31");
  }
  return {values[0], values[1], values[2], values[3]};
}

void add_city(Command& app) {
  Command& command = app.add_command("city", "build, convert and inspect city models");
  Command& info = command.add_command("info", "size, buildings, georeference and defects of a city");
  CityInfoArguments& arguments = info.run_with(run_city_info);
  info.add_option(
          "input", arguments.input, "FILE",
          "city: .canyon, map (.osm .osm.gz .osm.bz2 .osm.pbf, Overpass .json; CityGML and CityJSON: "
          "file, zip archive or folder of tiles), mesh (.dae .obj .stl .gltf .glb .ply), Gazebo world or "
          "model (.world .sdf, folder), 3D Tiles (tileset.json, or its https address), or a scenario: its "
          "city")
      .required();
  info.add_option("--origin", arguments.origin, "LAT,LON,HEIGHT",
                  "origin of a mesh, a map or a tileset (degrees, metres)");
  add_model_options(info, arguments.model);
  add_field(info, "--geoid-undulation", arguments.sea_level, "geoid_undulation_m");
  add_field(info, "--geoid", arguments.sea_level, "geoid");
  add_tile_options(info, arguments.tiles, true);
  info.add_flag("--json", arguments.json, "print JSON");
  add_city_build(command);
  add_city_view(command);
}

}  // namespace canyon::cli
