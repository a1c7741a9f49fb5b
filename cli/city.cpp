#include <fmt/format.h>

#include <chrono>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "cli/city_commands.hpp"
#include "cli/commands.hpp"
#include "cli/field_option.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {
namespace {

struct CityInfoArguments {
  std::string input;
  CityArguments city;
  bool json = false, quiet = false;
};

int run_city_info(const CityInfoArguments& arguments) {
  const simulation::CityConfig config = city_config(arguments.input, arguments.city);
  const auto begin = std::chrono::steady_clock::now();
  const buildings::BuiltCity loaded =
      read_city(config, "building the city", arguments.json || arguments.quiet);
  const city::City& city = loaded.city;
  print_report(city.notes, fmt::format("canyon check {}", arguments.input));
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
                   {"notes", city.notes.lines()},
                   {"report", report_json(city.notes)},
                   {"load_s", load_s}};
    fmt::print("{}\n", out.dump(2, Json::Order::ByKey));
    return kOk;
  }
  fmt::print("{}\n", city.name);
  if (loaded.is_georeferenced) {
    fmt::print("  origin        {:.6f}, {:.6f}, {:.1f} m\n", geodesy::degrees(origin.latitude_rad),
               geodesy::degrees(origin.longitude_rad), origin.height_m);
  } else {
    fmt::print("  origin        not known ({} has none; --origin, or city.origin in a scenario)\n",
               config.is<simulation::MeshCity>() ? "a mesh" : "this tileset");
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
  for (const std::string& note : city.notes.lines()) fmt::print("  note          {}\n", note);
  return kOk;
}

}  // namespace

void add_city_options(Command& command, CityArguments& arguments) {
  command.add_option("--bbox", arguments.bbox, "W,S,E,N",
                     "only buildings of a map, or tiles of a tileset, that touch this box (degrees)");
  add_change(command, "--lod", arguments.model, "lod");
  add_change(command, "--crs", arguments.model, "crs");
  add_change(command, "--error", arguments.tiles, "error_m");
  add_change(command, "--max-tiles", arguments.tiles, "max_tiles").formerly("--most-tiles");
  add_switch(command, "--allow-external", arguments.tiles, "allow_external").formerly("--elsewhere");
}

void add_georeference_options(Command& command, CityArguments& arguments) {
  command.add_option("--origin", arguments.origin, "LAT,LON,HEIGHT",
                     "origin of a mesh, a map or a tileset (degrees, metres)");
  add_change(command, "--geoid-undulation", arguments.sea_level, "geoid_undulation_m");
  add_change(command, "--geoid", arguments.sea_level, "geoid");
}

void change_city(simulation::CityConfig& config, const CityArguments& arguments, const std::string& input) {
  auto* map = config.as<simulation::MapCity>();
  auto* tileset = config.as<tiles::TileOptions>();
  const auto no_effect = [&](const char* options, const char* kind) {
    return InputError(
        fmt::format("{} have no effect on {}, which is not {}", options, tiles::public_address(input), kind),
        "leave them out");
  };
  if (!map && !arguments.model.empty()) throw no_effect("--lod and --crs", "a map");
  if (!tileset && !arguments.tiles.empty())
    throw no_effect("--error, --max-tiles and --allow-external", "3D Tiles");
  make(arguments.sea_level, config.sea_level);
  if (map) make(arguments.model, map->model);
  if (tileset) make(arguments.tiles, *tileset);
  if (arguments.bbox.empty()) return;
  const std::array<double, 4> box_deg = parse_bbox(arguments.bbox, "--bbox");
  if (map)
    map->bbox_deg = box_deg;
  else if (tileset)
    tileset->bbox_deg = box_deg;
  else
    throw InputError(fmt::format("--bbox has no effect on {}, which is not a map", input), "leave it out");
}

simulation::CityConfig city_config(const std::string& input, const CityArguments& arguments) {
  simulation::CityConfig config;
  std::optional<geodesy::Geodetic> origin;
  if (!arguments.origin.empty()) origin = parse_position(arguments.origin, "--origin");
  if (!is_scenario(input))
    config = simulation::city_config(input, origin);
  else if (!origin)
    config = simulation::city_config(simulation::read_scenario(input, {false}));
  else
    throw InputError("--origin is only for a mesh or map file", "a scenario has its own origin under city:");
  change_city(config, arguments, input);
  return config;
}

buildings::BuiltCity read_city(const simulation::CityConfig& config, const char* what, bool quiet) {
  ProgressLine progress(what, quiet);
  return simulation::read_city(config, progress.callback());
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
  add_georeference_options(info, arguments.city);
  add_city_options(info, arguments.city);
  info.add_flag("--json", arguments.json, "print JSON");
  info.add_flag("--quiet", arguments.quiet, "print no progress");
  add_city_build(command);
}

}  // namespace canyon::cli
