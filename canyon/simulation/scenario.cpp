#include "canyon/simulation/scenario.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/simulation/scenario_sections.hpp"
#include "canyon/simulation/trajectory.hpp"
#include "canyon/simulation/yaml_section.hpp"

namespace canyon::simulation {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;
using geodesy::radians;

constexpr Range kLatitude_deg{-90, 90};
constexpr Range kLongitude_deg{-180, 180};
constexpr Range kHeight_m{-10e3, 100e3};
constexpr Range kLocal_m{-1e6, 1e6};

// --- city
// ----------------------------------------------------------------------------------------------------

Geodetic read_origin(YamlSection& origin) {
  const double latitude = required(origin, "latitude_deg", kLatitude_deg);
  const double longitude = required(origin, "longitude_deg", kLongitude_deg);
  const Geodetic place =
      Geodetic::from_degrees(latitude, longitude, origin.number("height_m", kHeight_m).value_or(0));
  origin.finish();
  return place;
}

city::SyntheticCityOptions read_synthetic(YamlSection& section, const std::optional<Geodetic>& origin) {
  city::SyntheticCityOptions options;
  if (origin) options.origin = *origin;
  set(options.blocks_east, section.integer("blocks_east", 1, 200));
  set(options.blocks_north, section.integer("blocks_north", 1, 200));
  set(options.block_size_m, section.number("block_size_m", {10, 500}));
  set(options.street_width_m, section.number("street_width_m", {4, 100}));
  set(options.min_height_m, section.number("min_height_m", {1, 1000}));
  set(options.max_height_m, section.number("max_height_m", {1, 1000}));
  if (const auto seed = section.integer("seed", 0, std::numeric_limits<std::int64_t>::max())) {
    options.seed = static_cast<std::uint64_t>(*seed);
  }
  section.finish();
  validate(options, section);
  return options;
}

void read_mesh_keys(YamlSection& section, city::MeshImportOptions& import) {
  if (auto offset = section.section("offset")) {
    set(import.offset_m.x(), offset->number("east_m", kLocal_m));
    set(import.offset_m.y(), offset->number("north_m", kLocal_m));
    set(import.offset_m.z(), offset->number("up_m", kLocal_m));
    offset->finish();
  }
  set_deg(import.heading_rad, section.number("heading_deg", {-360, 360}));
  set(import.scale, section.number("scale", {0, 1e6, true}));
  if (const auto axis = section.choice("up_axis", {"Y", "Z"})) import.up_axis = axis->front();
  if (auto names = section.texts("terrain_names")) import.terrain_names = *std::move(names);
}

void read_map_keys(YamlSection& section, MapCityConfig& map) {
  if (auto rasters = section.existing_files("terrain")) map.terrain = *std::move(rasters);
  if (section.has("geoid_undulation_m") && !map.has_surveyed_heights()) {
    throw section.error("geoid_undulation_m", "there is no terrain to add it to",
                        "give terrain, or CityJSON, as well");
  }
  map.geoid_undulation_m = section.number("geoid_undulation_m", {-150, 150});
  if (const auto box = section.numbers("bbox", {-180, 180})) {
    if (box->size() != 4 || !((*box)[0] < (*box)[2]) || !((*box)[1] < (*box)[3]) || (*box)[1] < -90 ||
        (*box)[3] > 90) {
      throw section.error(
          "bbox", "is not a box",
          "give [west, south, east, north] in degrees, west below east and south below north");
    }
    map.bbox_deg = {(*box)[0], (*box)[1], (*box)[2], (*box)[3]};
  }
  map.level_height_m = section.number("level_height_m", {0, 20, true});
  map.default_height_m = section.number("default_height_m", {0.1, 1000});
  if (const auto heights = section.texts("heights")) {
    for (const std::string& text : *heights) {
      const std::size_t equals = text.find('=');
      const auto value = equals == std::string::npos
                             ? std::nullopt
                             : parse_double(std::string_view(text).substr(equals + 1));
      if (equals == 0 || !value || !(*value >= 0.1 && *value <= 1000)) {
        throw section.error("heights", fmt::format("'{}' is not TYPE=METRES", text),
                            "write heights: [house=7, office=20]; 0.1 to 1000 m");
      }
      map.heights_m[text.substr(0, equals)] = *value;
    }
  }
  set(map.foliage, section.boolean("foliage"));
}

CityConfig read_city(YamlSection& section) {
  CityConfig config;
  if (auto georeference = section.section("georeference")) {
    set(config.georeference.sigma_m, georeference->number("sigma_m", {0, 1000}));
    set_deg(config.georeference.heading_sigma_rad, georeference->number("heading_sigma_deg", {0, 45}));
    georeference->finish();
  }
  std::optional<Geodetic> origin;
  const auto kind = only_one(section, {"osm", "file", "mesh", "synthetic", "open"});
  if (kind == "mesh" || kind == "file") {
    const std::filesystem::path path = *section.existing_file(*kind);
    const auto file_kind = city_file_kind(path);
    if (file_kind == CityFileKind::Map) {
      config.map.emplace();
      config.map->files = {path};
    } else if (file_kind == CityFileKind::Canyon || file_kind == CityFileKind::Gazebo) {
      config.file = path;
    } else if (file_kind == CityFileKind::Mesh || kind == "mesh") {
      config.mesh = path;
    } else {
      throw section.error(*kind, fmt::format("'{}' has no ending of a city", path.string()),
                          city_file_endings());
    }
  } else if (kind == "osm") {
    config.map.emplace();
    config.map->files = *section.existing_files("osm");
  }
  if (config.file) {
    if (section.has("origin")) {
      throw section.error("origin", "the file says its own origin", "remove it");
    }
    section.finish();
    return config;
  }
  if (auto s = section.section("origin")) origin = read_origin(*s);
  if (config.map) {
    config.map->origin = origin;
    if (origin) config.import.origin = *origin;
    read_map_keys(section, *config.map);
    section.finish();
    return config;
  }
  if (kind == "synthetic") {
    auto synthetic = section.section("synthetic");
    config.synthetic = read_synthetic(*synthetic, origin);
    config.import.origin = config.synthetic->origin;
    section.finish();
    return config;
  }
  if (config.mesh) {
    read_mesh_keys(section, config.import);
  } else if (kind == "open") {
    config.open = *section.boolean("open");
  }
  if (!kind || (kind == "open" && !config.open)) {
    throw section.section_error("city has no content",
                                "give one of osm, file, mesh, synthetic: {} or open: true");
  }
  section.finish();
  if (!origin) {
    throw section.section_error("city has no origin", "add origin: {latitude_deg: ..., longitude_deg: ...}");
  }
  config.import.origin = *origin;
  validate(config.import, section);
  return config;
}

// --- trajectory
// -----------------------------------------------------------------------------------------------------

// A place as the next waypoint. `frame` is the city's, or nothing where only its file knows.
void read_place(YamlSection& section, const std::optional<geodesy::LocalFrame>& frame, bool height_needed,
                TrajectoryConfig& config) {
  const bool local = section.has("east_m") || section.has("north_m") || section.has("up_m");
  const auto height = [&](std::string_view key, const Range& range) {
    const auto value = section.number(key, range);
    if (!value && height_needed) {
      throw section.section_error(fmt::format("'{}' is missing", key),
                                  "give it, or trajectory.height_above_terrain_m");
    }
    return value.value_or(0);
  };
  Geodetic place;
  if (local) {
    const double east = required(section, "east_m", kLocal_m);
    const double north = required(section, "north_m", kLocal_m);
    const Eigen::Vector3d enu(east, north, height("up_m", kLocal_m));
    if (frame) {
      place = frame->geodetic_from_local(enu);
    } else {
      config.local_waypoints.emplace_back(config.waypoints.size(), enu);
    }
  } else {
    const double latitude = required(section, "latitude_deg", kLatitude_deg);
    const double longitude = required(section, "longitude_deg", kLongitude_deg);
    place = Geodetic::from_degrees(latitude, longitude, height("height_m", kHeight_m));
  }
  section.finish();
  config.waypoints.push_back(place);
}

TrajectoryConfig read_trajectory_section(YamlSection& section,
                                         const std::optional<geodesy::LocalFrame>& frame) {
  TrajectoryConfig config;
  config.height_above_terrain_m = section.number("height_above_terrain_m", {-100, 10e3});
  const bool height_needed = !config.height_above_terrain_m;
  const auto kind = only_one(section, {"file", "waypoints", "position"});
  if (!kind)
    throw section.section_error("trajectory has no content", "give one of file, waypoints or position");
  if (kind == "file") {
    config.file = section.existing_file("file");
    if (const auto format = section.choice("format", trajectory_formats())) config.format = *format;
  } else if (kind == "waypoints") {
    auto waypoints = section.sections("waypoints");
    for (YamlSection& waypoint : *waypoints) {
      read_place(waypoint, frame, height_needed, config);
    }
    set(config.speed_mps, section.number("speed_mps", {0, 1e4, true}));
    set(config.hold_s, section.number("hold_s", {0, 1e6}));
  } else {
    auto position = section.section("position");
    read_place(*position, frame, height_needed, config);
  }
  section.finish();
  return config;
}

// --- receivers
// -----------------------------------------------------------------------------------------------

std::vector<ReceiverConfig> read_receivers(YamlSection& root) {
  auto sections = root.sections("receivers");
  const auto propagation = root.section("propagation");
  const auto noise = root.section("noise");
  // Defaults, then the profile, then the scenario's own sections, then the receiver's keys.
  const auto make = [&](ReceiverConfig config) {
    if (auto section = propagation) read_propagation(*section, config.propagation);
    if (auto section = noise) read_noise(*section, config.options.noise);
    return config;
  };
  std::vector<ReceiverConfig> receivers;
  if (!sections) {
    receivers.push_back(make({}));
    receivers.back().options.name = "rover";
    return receivers;
  }
  for (YamlSection& section : *sections) {
    const auto name = section.text("name");
    if (!name && sections->size() > 1) {
      throw section.section_error("a receiver has no name", "name each of several receivers");
    }
    if (name) check_name(section, *name);
    ReceiverConfig config = make(read_profile_key(section));
    config.options.name = name.value_or("rover");
    for (const ReceiverConfig& other : receivers) {
      if (other.options.name == config.options.name) {
        throw section.error("name", fmt::format("'{}' names two receivers", config.options.name),
                            "give each its own name");
      }
    }
    read_receiver_keys(section, config);
    section.finish();
    receivers.push_back(std::move(config));
  }
  return receivers;
}

OutputConfig read_outputs(YamlSection& section) {
  OutputConfig config;
  set(config.epochs_csv, section.boolean("epochs_csv"));
  set(config.satellites_csv, section.boolean("satellites_csv"));
  set(config.nmea, section.boolean("nmea"));
  set(config.rinex_observation, section.boolean("rinex_observation"));
  set(config.rinex_navigation, section.boolean("rinex_navigation"));
  set(config.kml, section.boolean("kml"));
  set(config.geojson, section.boolean("geojson"));
  set(config.pictures, section.boolean("pictures"));
  section.finish();
  return config;
}

YamlSection required_section(YamlSection& root, const char* key, const char* cure) {
  auto section = root.section(key);
  if (!section) throw root.section_error(fmt::format("'{}' is missing", key), cure);
  return *std::move(section);
}

bool ends_with(const std::string& text, std::string_view end) {
  return text.size() > end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

}  // namespace

std::optional<CityFileKind> city_file_kind(const std::filesystem::path& path) {
  const std::string name = lower_case(path.filename().string());
  const auto any = [&name](std::initializer_list<const char*> endings) {
    return std::any_of(endings.begin(), endings.end(),
                       [&name](const char* ending) { return ends_with(name, ending); });
  };
  if (any({".osm", ".osm.gz", ".osm.bz2", ".pbf", ".json"})) return CityFileKind::Map;
  if (any({".canyon"})) return CityFileKind::Canyon;
  if (any({".dae", ".obj", ".stl", ".gltf", ".glb", ".ply"})) return CityFileKind::Mesh;
  std::error_code ignored;
  if (any({".world", ".sdf"}) || std::filesystem::exists(path / "model.sdf", ignored)) {
    return CityFileKind::Gazebo;
  }
  return std::nullopt;
}

const char* city_file_endings() {
  return "known are .osm, .osm.gz, .osm.bz2, .osm.pbf, .json (CityJSON), .canyon, .world, .sdf, .dae, .obj, "
         ".stl, .gltf, .glb, .ply";
}

Scenario parse_scenario(const std::string& text, const std::filesystem::path& name,
                        const ScenarioReadOptions& options) {
  std::vector<std::string> known;
  for (const ScenarioKey& key : scenario_keys()) known.push_back(key.path);
  YamlSection root = YamlSection::parse(text, name, std::move(known));

  Scenario scenario;
  scenario.file = name;
  YamlSection city = required_section(
      root, "city", "add city: {osm: ...}, city: {mesh: ..., origin: ...}, or city: {synthetic: {}}");
  scenario.city = read_city(city);
  if (auto sky = root.section("sky")) {
    scenario.sky = read_sky(*sky);
  } else {
    scenario.sky.nominal = true;
  }
  scenario.start = read_start(root);
  scenario.duration_s = root.number("duration_s", {0, 1e8});
  scenario.rate_hz = root.number("rate_hz", {0, 1000, true});
  if (options.trajectory_needed || root.has("trajectory")) {
    YamlSection trajectory =
        required_section(root, "trajectory", "add trajectory: {file: ...}, waypoints or position");
    std::optional<geodesy::LocalFrame> frame;
    if (scenario.city.origin_known()) frame.emplace(scenario.city.import.origin);
    scenario.trajectory = read_trajectory_section(trajectory, frame);
  }
  scenario.receivers = read_receivers(root);
  scenario.seed = read_seed(root);
  if (auto outputs = root.section("outputs")) scenario.outputs = read_outputs(*outputs);
  root.finish();
  return scenario;
}

Scenario read_scenario(const std::filesystem::path& path, const ScenarioReadOptions& options) {
  constexpr std::size_t kMaxBytes = std::size_t{16} << 20;
  const TextFile file(path, kMaxBytes);
  return parse_scenario(std::string(file.text()), path, options);
}

bool is_cityjson(const std::filesystem::path& path) {
  const std::string ending = path.extension().string();
  return ending == ".json" || ending == ".JSON";
}

bool MapCityConfig::has_surveyed_heights() const {
  return !terrain.empty() || std::any_of(files.begin(), files.end(), is_cityjson);
}

}  // namespace canyon::simulation
