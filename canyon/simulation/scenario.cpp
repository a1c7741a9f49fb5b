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
#include "canyon/receiver/preset.hpp"
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

// The key overrides the field where it is there.
void set(double& field, const std::optional<double>& value) {
  field = value.value_or(field);
}
void set(bool& field, const std::optional<bool>& value) {
  field = value.value_or(field);
}
void set(int& field, const std::optional<std::int64_t>& value) {
  if (value) field = static_cast<int>(*value);
}
void set_deg(double& field_rad, const std::optional<double>& value_deg) {
  if (value_deg) field_rad = radians(*value_deg);
}

std::string key_list(const std::vector<std::string>& keys) {
  std::string list;
  for (std::size_t i = 0; i < keys.size(); ++i)
    list += (i == 0 ? "" : i + 1 == keys.size() ? " or " : ", ") + keys[i];
  return list;
}

// Which one of the alternatives is there; nothing where none is.
std::optional<std::string> only_one(const YamlSection& section, const std::vector<std::string>& keys) {
  std::optional<std::string> found;
  for (const std::string& key : keys) {
    if (!section.has(key)) continue;
    if (found)
      throw section.error(key, fmt::format("stands beside '{}'", *found), "keep one of " + key_list(keys));
    found = key;
  }
  return found;
}

double required(YamlSection& section, std::string_view key, const Range& range) {
  const auto value = section.number(key, range);
  if (!value) throw section.section_error(fmt::format("'{}' is missing", key));
  return *value;
}

// A struct's own validate() has the last word on what ranges of single keys cannot say.
template <typename Options>
void validate(const Options& options, const YamlSection& section) {
  try {
    options.validate();
  } catch (const InputError& e) {
    throw section.section_error(e.problem(), e.cure());
  }
}

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

// --- sky
// -----------------------------------------------------------------------------------------------------

void read_frozen(YamlSection& section, SkyConfig& config) {
  const auto azimuths = section.numbers("satAzimuth", {-1e6, 1e6});
  const auto elevations = section.numbers("satElevation", {-1e6, 1e6});
  if (!azimuths || !elevations) {
    throw section.section_error("frozen needs satAzimuth and satElevation", "give lists of radians");
  }
  const auto in_radians = [&section](const char* key, const std::vector<double>& values, double low,
                                     double high) {
    for (const double value : values) {
      // 1.5708 means the zenith.
      if (value >= low - 1e-5 && value <= high + 1e-5) continue;
      throw section.error(key, fmt::format("{} is out of range", value),
                          fmt::format("it is in radians, from {:.6g} to {:.6g}; {} deg is {:.6f}", low, high,
                                      value, radians(value)));
    }
  };
  in_radians("satAzimuth", *azimuths, -2 * geodesy::kPi, 2 * geodesy::kPi);
  in_radians("satElevation", *elevations, 0, geodesy::kPi / 2);
  const auto count = section.integer("satNum", 1, 63);
  const auto length = count ? static_cast<std::size_t>(*count) : azimuths->size();
  if (azimuths->size() != elevations->size() || azimuths->size() != length) {
    throw section.error(count ? "satNum" : "satElevation",
                        fmt::format("{} azimuths and {} elevations for {} satellites", azimuths->size(),
                                    elevations->size(), length),
                        "give one of each for every satellite");
  }
  section.finish();
  config.frozen_azimuth_rad = *azimuths;
  config.frozen_elevation_rad = *elevations;
}

SkyConfig read_sky(YamlSection& section) {
  SkyConfig config;
  const auto kind = only_one(section, {"navigation", "sp3", "nominal", "frozen"});
  if (kind == "navigation") {
    config.navigation = *section.existing_files("navigation");
  } else if (kind == "sp3") {
    config.sp3 = section.existing_file("sp3");
  } else if (kind == "frozen") {
    auto frozen = section.section("frozen");
    read_frozen(*frozen, config);
  } else {
    if (kind && !*section.boolean("nominal")) {
      throw section.error("nominal", "false, and no other source",
                          "give one of navigation, sp3, frozen, or nominal: true");
    }
    config.nominal = true;
  }
  if (kind != "frozen") {
    if (const auto names = section.texts("systems")) {
      config.systems.clear();
      for (const std::string& name : *names) {
        try {
          config.systems.insert(orbit::system_from_name(name));
        } catch (const InputError& e) {
          throw section.error("systems", e.problem(), e.cure());
        }
      }
    }
  }
  if (kind == "navigation") set(config.allow_stale, section.boolean("allow_stale"));
  section.finish();
  return config;
}

// --- time and trajectory
// -------------------------------------------------------------------------------------

std::optional<GpsTime> read_start(YamlSection& root) {
  if (!root.has("start")) return std::nullopt;
  if (root.is_section("start")) {
    auto section = root.section("start");
    const auto week = section->integer("week", 0, 9999);
    if (!week) throw section->section_error("'week' is missing", "write start: {week: 2051, tow: 46701}");
    const double tow = required(*section, "tow", {0, 604800, false, true});
    section->finish();
    return GpsTime::from_week(static_cast<int>(*week), tow);
  }
  const auto text = root.text("start");
  try {
    return geodesy::parse_time(*text);
  } catch (const InputError& e) {
    throw root.error("start", e.problem(), e.cure());
  }
}

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

void read_propagation(YamlSection& section, propagation::PropagationOptions& options) {
  if (const auto model = section.choice("model", {"specular", "mirror"})) {
    options.model = *model == "mirror" ? propagation::Model::Mirror : propagation::Model::Specular;
  }
  set(options.reflection_order, section.integer("reflection_order", 0, 1));
  set(options.max_range_m, section.number("max_range_m", {0, 100e3, true}));
  set_deg(options.max_incidence_rad, section.number("max_incidence_deg", {0, 90, true}));
  set(options.ground_reflection, section.boolean("ground_reflection"));
  section.finish();
  validate(options, section);
}

void read_noise(YamlSection& section, receiver::NoiseOptions& options) {
  set(options.enabled, section.boolean("enabled"));
  set(options.ou.theta_per_s, section.number("theta_per_s", {0, 1e6, true}));
  set(options.ou.mu_m, section.number("mu_m", {-1e6, 1e6}));
  set(options.ou.sigma_m_per_sqrt_s, section.number("sigma_m_per_sqrt_s", {0, 1e6}));
  set(options.doppler_sigma_hz, section.number("doppler_sigma_hz", {0, 1e6}));
  if (auto drift = section.section("drift")) {
    set(options.drift_enabled, drift->boolean("enabled"));
    set(options.drift_below_speed_mps, drift->number("below_speed_mps", {0, 1e4}));
    set(options.drift_below_los, drift->integer("below_los", 0, 1000));
    set(options.drift_mu_sigma_m, drift->number("mu_sigma_m", {0, 1e6}));
    drift->finish();
  }
  section.finish();
  validate(options, section);
}

ReceiverConfig preset(const std::string& name) {
  ReceiverConfig config;
  config.options = receiver::receiver_preset(name);
  // The paper's receiver hears the paper's mirror model.
  if (name == "paper") config.propagation.model = propagation::Model::Mirror;
  return config;
}

void read_receiver_keys(YamlSection& section, ReceiverConfig& config) {
  receiver::ReceiverOptions& o = config.options;
  set_deg(o.fix.elevation_mask_rad, section.number("elevation_mask_deg", {0, 90, false, true}));
  set(o.fix.min_satellites, section.integer("min_satellites", 4, 1000));
  set(o.fix.max_iterations, section.integer("max_iterations", 5, 1000));
  set(o.fix.convergence_m, section.number("convergence_m", {0, 1, true}));
  set(o.ionosphere, section.boolean("ionosphere"));
  set(o.troposphere, section.boolean("troposphere"));
  set(o.fix.correct_ionosphere, section.boolean("correct_ionosphere"));
  set(o.fix.correct_troposphere, section.boolean("correct_troposphere"));
  if (auto lever = section.section("lever_arm")) {
    set(config.lever_arm_m.x(), lever->number("forward_m", {-1000, 1000}));
    set(config.lever_arm_m.y(), lever->number("left_m", {-1000, 1000}));
    set(config.lever_arm_m.z(), lever->number("up_m", {-1000, 1000}));
    lever->finish();
  }
  if (auto clock = section.section("clock")) {
    set(o.clock.bias_s, clock->number("bias_s", {-0.1, 0.1}));
    set(o.clock.drift, clock->number("drift", {-1e-4, 1e-4}));
    set(o.clock.drift_walk, clock->number("drift_walk", {0, 1e-4}));
    clock->finish();
  }
  if (auto noise = section.section("noise")) read_noise(*noise, o.noise);
  if (auto propagation = section.section("propagation")) read_propagation(*propagation, config.propagation);
  section.finish();
  validate(o, section);
}

// Names become folder names and NMEA has no quotes: letters, digits, '-', '_', '.', not first a dot.
void check_name(const YamlSection& section, const std::string& name) {
  const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_' || c == '.';
  });
  if (!plain || name.front() == '.' || name.size() > 60) {
    throw section.error("name", fmt::format("'{}' cannot name a folder", name),
                        "use at most 60 letters, digits, '-', '_' and '.', a dot not first");
  }
}

std::vector<ReceiverConfig> read_receivers(YamlSection& root) {
  auto sections = root.sections("receivers");
  const auto propagation = root.section("propagation");
  const auto noise = root.section("noise");
  // Defaults, then the preset, then the scenario's own sections, then the receiver's keys.
  const auto make = [&](const std::string& preset_name) {
    ReceiverConfig config = preset(preset_name);
    if (auto section = propagation) read_propagation(*section, config.propagation);
    if (auto section = noise) read_noise(*section, config.options.noise);
    return config;
  };
  std::vector<ReceiverConfig> receivers;
  if (!sections) {
    receivers.push_back(make("default"));
    receivers.back().options.name = "rover";
    return receivers;
  }
  for (YamlSection& section : *sections) {
    const auto name = section.text("name");
    if (!name && sections->size() > 1) {
      throw section.section_error("a receiver has no name", "name each of several receivers");
    }
    if (name) check_name(section, *name);
    ReceiverConfig config =
        make(section.choice("preset", receiver::receiver_preset_names()).value_or("default"));
    config.options.name = name.value_or("rover");
    for (const ReceiverConfig& other : receivers) {
      if (other.options.name == config.options.name) {
        throw section.error("name", fmt::format("'{}' names two receivers", config.options.name),
                            "give each its own name");
      }
    }
    read_receiver_keys(section, config);
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

Scenario parse_scenario(const std::string& text, const std::filesystem::path& name) {
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
  YamlSection trajectory =
      required_section(root, "trajectory", "add trajectory: {file: ...}, waypoints or position");
  std::optional<geodesy::LocalFrame> frame;
  if (scenario.city.origin_known()) frame.emplace(scenario.city.import.origin);
  scenario.trajectory = read_trajectory_section(trajectory, frame);
  scenario.receivers = read_receivers(root);
  if (const auto seed = root.integer("seed", 0, std::numeric_limits<std::int64_t>::max())) {
    scenario.seed = static_cast<std::uint64_t>(*seed);
  }
  if (auto outputs = root.section("outputs")) scenario.outputs = read_outputs(*outputs);
  root.finish();
  return scenario;
}

Scenario read_scenario(const std::filesystem::path& path) {
  constexpr std::size_t kMaxBytes = std::size_t{16} << 20;
  const TextFile file(path, kMaxBytes);
  return parse_scenario(std::string(file.text()), path);
}

bool is_cityjson(const std::filesystem::path& path) {
  const std::string ending = path.extension().string();
  return ending == ".json" || ending == ".JSON";
}

bool MapCityConfig::has_surveyed_heights() const {
  return !terrain.empty() || std::any_of(files.begin(), files.end(), is_cityjson);
}

}  // namespace canyon::simulation
