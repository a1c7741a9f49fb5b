#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/city/buildings/city_builder.hpp"
#include "canyon/city/buildings/footprints_geojson.hpp"
#include "canyon/city/buildings/sources/overpass.hpp"
#include "canyon/city/city_file.hpp"
#include "canyon/city/gazebo_export.hpp"
#include "canyon/city/mesh_export.hpp"
#include "canyon/simulation/load_city.hpp"
#include "cli/city_commands.hpp"
#include "cli/field_option.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {
namespace {

using simulation::is_file_of;
using simulation::MapCity;
using simulation::MeshCity;

struct CityBuildArguments {
  std::vector<std::string> inputs;
  std::vector<std::string> outputs;
  std::vector<std::string> terrain;
  MapCity map;  ///< only its numbers; the rest comes from the other fields
  CityArguments city;
  buildings::OverpassOptions download;
  std::string area;
  std::string name;
  bool quiet = false;
  bool json = false;
};

enum class Format { Canyon, Mesh, GeoJson, World, Model };

struct Output {
  std::filesystem::path path;
  Format format = Format::Canyon;
};

// Before reading any input: a mistyped name should not end minutes of work.
Output parse_output(const std::string& text, bool from_map) {
  Output out;
  const bool folder = !text.empty() && text.back() == '/';
  out.path = folder ? std::filesystem::path(text.substr(0, text.find_last_not_of('/') + 1))
                    : std::filesystem::path(text);
  const std::string ending = out.path.extension().string();
  if (folder || ending.empty()) {
    out.format = Format::Model;
  } else if (ending == ".canyon") {
    out.format = Format::Canyon;
  } else if (ending == ".glb" || ending == ".obj" || ending == ".dae") {
    out.format = Format::Mesh;
  } else if (ending == ".geojson") {
    out.format = Format::GeoJson;
    if (!from_map) {
      throw InputError(fmt::format("-o {}: footprints come from a map only", text),
                       "give OpenStreetMap, CityGML or CityJSON input, or another format");
    }
  } else if (ending == ".world" || ending == ".sdf") {
    out.format = Format::World;
  } else {
    throw InputError(fmt::format("-o {}: no format ends in {}", text, ending),
                     "use .canyon, .glb, .obj, .dae, .geojson, .world, .sdf, or a folder for a Gazebo model");
  }
  if (out.path.filename().empty()) throw InputError(fmt::format("-o '{}' names no file or folder", text));
  const std::filesystem::path parent = out.path.parent_path();
  std::error_code ignored;
  if (!parent.empty() && !std::filesystem::is_directory(parent, ignored)) {
    throw InputError(fmt::format("-o {}: the folder {} does not exist", text, parent.string()),
                     "make it first");
  }
  return out;
}

std::vector<std::filesystem::path> download(const CityBuildArguments& arguments, MapCity& map) {
  buildings::OverpassOptions options = arguments.download;
  options.foliage = map.build.foliage;
  options.validate();
  buildings::LonLatBox box;
  if (map.bbox_deg) {
    const auto& [west, south, east, north] = *map.bbox_deg;
    box = {west, south, east, north};
  } else {
    box = buildings::find_named_area(arguments.area, options);
    map.bbox_deg = {box.west, box.south, box.east, box.north};
  }
  box.validate();
  ProgressLine progress("downloading", arguments.quiet);
  return buildings::download_osm(box, options, progress.callback());
}

simulation::CityConfig make_config(const CityBuildArguments& arguments, const Command& command) {
  const bool online = command.given("--overpass") || command.given("--place");
  if (arguments.inputs.empty() && !online) {
    throw InputError("nothing to build from",
                     "give map or city files, or --place NAME, or --overpass URL with --bbox");
  }
  if (online && arguments.area.empty() && arguments.city.bbox.empty())
    throw InputError("--overpass without --place or --bbox", "give the area to download");
  if (!arguments.inputs.empty() && !is_file_of<MapCity>(arguments.inputs.front())) {
    const std::string& input = arguments.inputs.front();
    if (arguments.inputs.size() > 1) {
      throw InputError(fmt::format("{} is not a map and is given with other input", input),
                       "only maps can be combined; convert other cities one by one");
    }
    for (const char* option : {"--terrain", "--level-height", "--default-height", "--height", "--foliage"}) {
      if (command.given(option)) {
        throw InputError(fmt::format("{} has no effect on {}, which is not a map", option, input),
                         "leave it out");
      }
    }
    simulation::CityConfig config = city_config(input, arguments.city);
    if (auto* tileset = config.as<tiles::TileOptions>()) tileset->cache = arguments.download.cache.string();
    return config;
  }
  simulation::CityConfig config;
  MapCity& map = config.source.emplace<MapCity>(arguments.map);
  for (const std::string& input : arguments.inputs) {
    if (!is_file_of<MapCity>(input)) {
      throw InputError(fmt::format("{} is not a map and is given with maps", input),
                       simulation::city_file_endings());
    }
    map.files.emplace_back(input);
  }
  map.terrain.assign(arguments.terrain.begin(), arguments.terrain.end());
  if (!arguments.city.origin.empty()) config.origin = parse_position(arguments.city.origin, "--origin");
  change_city(config, arguments.city, "a map");
  if (online) map.files = download(arguments, map);
  return config;
}

// The path's stem as a valid name for SDF and files.
std::string model_name(const std::filesystem::path& path) {
  std::string name = path.stem().string();
  std::replace_if(
      name.begin(), name.end(),
      [](char c) {
        return !((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
                 c == '_');
      },
      '_');
  return name;
}

void write(const Output& out, const buildings::BuiltCity& loaded, const CityBuildArguments& arguments) {
  city::GazeboOptions gazebo;
  gazebo.name = arguments.name.empty() ? model_name(out.path) : arguments.name;
  switch (out.format) {
    case Format::Canyon:
      city::write_city_file(out.path, loaded.city);
      break;
    case Format::Mesh:
      city::write_mesh(out.path, loaded.city);
      break;
    case Format::GeoJson:
      buildings::write_footprints_geojson(out.path, loaded);
      break;
    case Format::World:
      city::write_gazebo_world(out.path, loaded.city, gazebo);
      break;
    case Format::Model:
      city::write_gazebo_model(out.path, loaded.city, gazebo);
      break;
  }
}

Json to_json(const buildings::BuildReport& r) {
  return {{"buildings", r.buildings},
          {"parts", r.parts},
          {"trees", r.trees},
          {"woods", r.woods},
          {"outlines_replaced", r.outlines_replaced},
          {"outlines_cut", r.outlines_cut},
          {"parts_alone", r.parts_alone},
          {"parts_beyond", r.parts_beyond},
          {"structures", r.structures},
          {"surveyed", r.surveyed},
          {"heights_tagged", r.heights_tagged},
          {"heights_from_levels", r.heights_from_levels},
          {"heights_default", r.heights_default},
          {"heights_inherited", r.heights_inherited},
          {"roofs_default", r.roofs_default},
          {"materials_default", r.materials_default},
          {"repaired", r.repaired},
          {"skipped", r.skipped},
          {"foliage_left_out", r.foliage_left_out}};
}

/// A mesh, or a tileset with its own frame, is not georeferenced, but these formats need a position.
void require_georeference(const Output& out, bool is_located, const CityBuildArguments& arguments) {
  const Format format = out.format;
  const bool claims = format == Format::Canyon || format == Format::World || format == Format::Model;
  if (is_located || !claims || !arguments.city.origin.empty()) return;
  throw InputError(fmt::format("-o {}: {} is not georeferenced", out.path.string(), arguments.inputs.front()),
                   "give --origin LAT,LON,HEIGHT of its zero");
}

int run_city_build(const CityBuildArguments& arguments, const Command& command) {
  const bool from_map = arguments.inputs.empty() || is_file_of<MapCity>(arguments.inputs.front());
  const bool from_mesh = !arguments.inputs.empty() && is_file_of<MeshCity>(arguments.inputs.front());
  std::vector<Output> outputs;
  for (const std::string& text : arguments.outputs) {
    outputs.push_back(parse_output(text, from_map));
    require_georeference(outputs.back(), !from_mesh, arguments);
  }

  const auto begin = std::chrono::steady_clock::now();
  const simulation::CityConfig config = make_config(arguments, command);
  buildings::BuiltCity loaded = read_city(config, "building", arguments.quiet);
  if (!arguments.name.empty()) loaded.city.name = arguments.name;
  const double build_s = seconds_since(begin);
  for (const Output& out : outputs) {
    require_georeference(out, loaded.is_georeferenced, arguments);
    write(out, loaded, arguments);
  }
  const double all_s = seconds_since(begin);
  const ReadReport& notes = loaded.city.notes;
  print_report(notes, fmt::format("canyon check {}", fmt::join(arguments.inputs, " ")));

  const city::CitySummary summary = city::summarize(loaded.city);
  if (arguments.json) {
    Json out{{"name", loaded.city.name},
             {"triangles", summary.triangles},
             {"highest_roof_m", summary.highest_roof_m},
             {"build_s", build_s},
             {"write_s", all_s - build_s},
             {"warnings", notes.warnings()},
             {"notes", report_json(notes)},
             {"outputs", arguments.outputs}};
    if (from_map) out["report"] = to_json(loaded.report);
    fmt::print("{}\n", out.dump(2, Json::Order::ByKey));
    return kOk;
  }
  if (arguments.quiet) return kOk;
  if (config.is<tiles::TileOptions>())
    for (const std::string& note : notes.lines()) fmt::print("note        {}\n", note);
  if (from_map) fmt::print("{}", buildings::format_report(loaded.report));
  fmt::print("mesh        {} triangles, highest roof {:.1f} m\n", summary.triangles, summary.highest_roof_m);
  fmt::print("built in {:.2f} s, written in {:.2f} s:", build_s, all_s - build_s);
  for (const Output& out : outputs) fmt::print(" {}", out.path.string());
  fmt::print("\n");
  return kOk;
}

}  // namespace

void add_city_build(Command& city) {
  auto arguments = std::make_shared<CityBuildArguments>();
  Command& build = city.add_command("build", "build a city from maps, or convert one");
  build.add_option(
      "input", arguments->inputs, "INPUT",
      "maps (.osm .osm.gz .osm.bz2 .osm.pbf, Overpass .json; CityGML and CityJSON: files, zip "
      "archives and folders of tiles), or one city (.canyon, mesh, Gazebo world or model, 3D Tiles)");
  build
      .add_option("-o,--out", arguments->outputs, "OUT",
                  "output, by its ending: .canyon .glb .obj .dae .geojson .world .sdf; a folder (ends in / "
                  "or has no ending): a Gazebo model; may be repeated")
      .required()
      .writes()
      .repeated();
  add_georeference_options(build, arguments->city);
  add_city_options(build, arguments->city);
  build.add_option("--terrain", arguments->terrain, "FILE", "height rasters (GeoTIFF, SRTM HGT, ...)");
  add_field(build, "--level-height", arguments->map.build, "level_height_m");
  add_field(build, "--default-height", arguments->map.build, "default_height_m");
  add_field(build, "--height", arguments->map.build, "heights").value = "TYPE=M";
  build.add_flag("--foliage", arguments->map.build.foliage, "also read trees, tree rows and woods");
  add_field(build, "--overpass", arguments->download, "url").excludes("input").value = "URL";
  build.add_option("--place", arguments->area, "NAME", "download an area by its name")
      .excludes("input")
      .excludes("--bbox");
  add_field(build, "--cache", arguments->download, "cache").value = "DIR";
  build.add_option("--name", arguments->name, "NAME", "of the city and of Gazebo's model");
  build.add_flag("--quiet", arguments->quiet, "print warnings and errors only");
  build.add_flag("--json", arguments->json, "print the report as JSON");
  build.action = [arguments, &build] { return run_city_build(*arguments, build); };
}

}  // namespace canyon::cli
