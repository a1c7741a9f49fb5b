#include "canyon/simulation/scenario/scenario_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/motion/csv_track.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/profile.hpp"

namespace canyon::simulation {

options::Document document_of(const std::filesystem::path& name, const char* kind) {
  options::Document document;
  document.file = name;
  document.kind = kind;
  return document;
}

namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;
using options::Range;
using options::Visitor;

// --- sky

void visit_frozen(Visitor& v, SkyConfig& sky) {
  if (v.reads() && !(v.has("satAzimuth") && v.has("satElevation")))
    throw v.fault({}, "frozen needs satAzimuth and satElevation", "give lists of radians");
  int count = static_cast<int>(sky.frozen_azimuth_rad.size());
  std::vector<double>& azimuths = sky.frozen_azimuth_rad;
  std::vector<double>& elevations = sky.frozen_elevation_rad;
  v.integer({"satNum", "satellites", "the paper's number of fixed virtual satellites", "the lists' length"},
            count, 1, 63);
  v.numbers({"satAzimuth", "rad", "their azimuths from north, clockwise"}, azimuths, {});
  v.numbers({"satElevation", "rad", "their elevations"}, elevations, {});
  if (!v.reads()) return;
  const auto in_radians = [&v](const char* key, const std::vector<double>& values, double low, double high) {
    for (const double value : values) {
      // 1.5708 is accepted as the zenith.
      if (value >= low - 1e-5 && value <= high + 1e-5) continue;
      throw v.fault(key, fmt::format("{} is out of range", value),
                    fmt::format("give radians from {:.6g} to {:.6g}; {} deg is {:.6f}", low, high, value,
                                geodesy::radians(value)));
    }
  };
  in_radians("satAzimuth", azimuths, -2 * geodesy::kPi, 2 * geodesy::kPi);
  in_radians("satElevation", elevations, 0, geodesy::kPi / 2);
  const bool counted = v.has("satNum");
  const auto length = counted ? static_cast<std::size_t>(count) : azimuths.size();
  if (azimuths.size() != elevations.size() || azimuths.size() != length) {
    throw v.fault(counted ? "satNum" : "satElevation",
                  fmt::format("{} azimuths and {} elevations for {} satellites", azimuths.size(),
                              elevations.size(), length),
                  "give one of each for every satellite");
  }
}

void visit_systems(Visitor& v, std::set<gnss::System>& systems) {
  std::vector<std::string> names;
  names.reserve(systems.size());
  for (const gnss::System system : systems) names.emplace_back(gnss::name(system));
  v.texts({"systems", "",
           "GPS, GLONASS, Galileo, BeiDou, QZSS, SBAS: one, several with blanks between, or a list",
           "all but SBAS"},
          names);
  if (!v.has("systems")) return;
  systems.clear();
  for (std::string& text : names) {
    std::replace(text.begin(), text.end(), ',', ' ');
    for (const std::string_view name : split_blanks(text)) {
      try {
        systems.insert(gnss::system_from_name(name));
      } catch (const InputError& e) {
        throw v.fault("systems", e.problem(), e.hint());
      }
    }
  }
  if (systems.empty())
    throw v.fault("systems", "contains no system", "write GPS, GLONASS, Galileo, BeiDou, QZSS, SBAS");
}

}  // namespace

void visit(Visitor& v, SkyConfig& sky) {
  v.one_of({"navigation", "sp3", "nominal", "frozen"});
  v.files({"navigation", "", "RINEX navigation files, one or several, plain or gzip",
           "one of navigation, sp3, nominal and frozen"},
          sky.navigation);
  v.files({"sp3", "", "precise orbits, SP3-c or SP3-d, one or several, plain or gzip"}, sky.sp3);
  if (v.wants(sky.nominal || v.has("nominal"))) {
    v.boolean({"nominal", "",
               "the nominal constellations of GPS, GLONASS, Galileo and BeiDou at any date; needs no file",
               "true without another source"},
              sky.nominal);
  }
  if (v.reads()) {
    if (v.has("nominal") && !sky.nominal) {
      throw v.fault("nominal", "is false, but there is no other source",
                    "give one of navigation, sp3 and frozen, or true");
    }
    sky.nominal = sky.navigation.empty() && sky.sp3.empty() && !v.has("frozen");
  }
  const bool frozen = v.has("frozen") || !sky.frozen_azimuth_rad.empty();
  if (v.wants(frozen)) v.section("frozen", [&] { visit_frozen(v, sky); });
  if (v.wants(!frozen)) visit_systems(v, sky.systems);
  if (v.wants(!sky.navigation.empty())) {
    v.boolean({"allow_stale", "", "use ephemerides older than their system allows, with a warning"},
              sky.allow_stale);
  }
  if (v.wants(!frozen)) v.part("errors", sky.errors);
}

// --- positions and routes: trajectory, waypoints, fixed antennas

namespace {

constexpr Range kLocal_m{-1e6, 1e6};

using PositionKeys = disturbance::PositionOptions;

PositionKeys keys_of(const TrajectoryConfig& config, std::size_t index) {
  PositionKeys keys;
  for (const auto& [number, enu] : config.local_waypoints) {
    if (number != index) continue;
    keys.east_m = enu.x(), keys.north_m = enu.y(), keys.up_m = enu.z();
    return keys;
  }
  const Geodetic& position = config.waypoints[index];
  keys.latitude_deg = options::exact_degrees(position.latitude_rad);
  keys.longitude_deg = options::exact_degrees(position.longitude_rad);
  keys.height_m = position.height_m;
  return keys;
}

// The city's frame; empty if only its file has it.
std::optional<geodesy::LocalFrame> known_frame(Visitor& v, const CityConfig& city) {
  std::optional<geodesy::LocalFrame> frame;
  if (v.reads() && city.origin) frame.emplace(*city.origin);
  return frame;
}

// A position by its keys. @param height_hint for a missing height; empty: the height may be absent
FixedPosition position_of(Visitor& v, const PositionKeys& keys,
                          const std::optional<geodesy::LocalFrame>& frame, std::string_view height_hint) {
  const auto height = [&](std::string_view key, const std::optional<double>& value) {
    if (!value && !height_hint.empty()) throw v.fault({}, fmt::format("'{}' is missing", key), height_hint);
    return value.value_or(0);
  };
  FixedPosition position;
  if (keys.east_m || keys.north_m || keys.up_m) {
    constexpr std::string_view kHint =
        "use either east_m, north_m and up_m or latitude_deg, longitude_deg and height_m";
    v.require("east_m", kHint);
    v.require("north_m", kHint);
    position.local_m = Eigen::Vector3d(*keys.east_m, *keys.north_m, height("up_m", keys.up_m));
    if (frame) position.position = frame->geodetic_from_local(*position.local_m);
  } else {
    v.require("latitude_deg");
    v.require("longitude_deg");
    position.position =
        Geodetic::from_degrees(*keys.latitude_deg, *keys.longitude_deg, height("height_m", keys.height_m));
  }
  return position;
}

// A position becomes the next waypoint.
void add_position(Visitor& v, const PositionKeys& keys, const std::optional<geodesy::LocalFrame>& frame,
                  TrajectoryConfig& config, bool on_terrain = false) {
  const FixedPosition position = position_of(
      v, keys, frame,
      on_terrain || config.height_above_terrain_m ? "" : "give it, or trajectory.height_above_terrain_m");
  if (position.local_m) config.local_waypoints.emplace_back(config.waypoints.size(), *position.local_m);
  config.waypoints.push_back(position.position);
}

// `height_note`: after the help of heights.
void visit_position(Visitor& v, PositionKeys& keys, const std::string& what, const std::string& height_note) {
  const bool local = keys.east_m || v.has("east_m") || v.has("north_m") || v.has("up_m");
  const std::string latitude = what + ": geodetic latitude (WGS 84)";
  const std::string height = "ellipsoidal height" + height_note, up = "above the city's origin" + height_note;
  if (v.wants(!local)) {
    v.number({"latitude_deg", "deg", latitude}, keys.latitude_deg, kLatitude_deg);
    v.number({"longitude_deg", "deg", "longitude, east positive"}, keys.longitude_deg, kLongitude_deg);
    v.number({"height_m", "m", height}, keys.height_m, kHeight_m);
  }
  if (v.wants(local)) {
    v.number({"east_m", "m",
              "east of the city's origin, with north_m and up_m instead of latitude, longitude and height"},
             keys.east_m, kLocal_m);
    v.number({"north_m", "m", "north of the city's origin"}, keys.north_m, kLocal_m);
    v.number({"up_m", "m", up}, keys.up_m, kLocal_m);
  }
}

struct WaypointKeys {
  PositionKeys position;
  TrajectoryConfig::Leg leg;
};

void visit_leg(Visitor& v, TrajectoryConfig::Leg& leg) {
  if (v.wants(v.reads() || leg.height_above_terrain_m)) {
    v.number({"height_above_terrain_m", "m", "height above the terrain at this waypoint", "none"},
             leg.height_above_terrain_m, {-100, 10e3});
  }
  v.number({"speed_mps", "m/s", "speed on the leg that ends here", "the trajectory's"}, leg.speed_mps,
           {0, 1e4, true});
  v.number({"hold_s", "s", "time at rest here", "the trajectory's"}, leg.hold_s, {0, 1e6});
}

void visit_columns(Visitor& v, TrajectoryConfig& config) {
  if (!v.wants(v.reads() ? v.has("columns") : !config.columns.empty())) return;
  if (v.reads() && !config.format.empty() && config.format != "csv")
    throw v.fault("columns", fmt::format("belongs to format csv, not {}", config.format), "remove it");
  v.section("columns", [&] {
    for (const CsvQuantity& quantity : csv_quantities()) {
      std::optional<std::string> name;
      if (const auto at = config.columns.find(std::string(quantity.name)); at != config.columns.end())
        name = at->second;
      v.text({quantity.name, "", quantity.help}, name);
      if (v.reads() && name) config.columns[std::string(quantity.name)] = *name;
    }
  });
}

const char* const kHeightNote = "; may be left out with height_above_terrain_m";

}  // namespace

void visit_trajectory(Visitor& v, TrajectoryConfig& config, const CityConfig& city) {
  const std::optional<geodesy::LocalFrame> frame = known_frame(v, city);
  v.one_of({"file", "waypoints", "position"}, "give one of file, waypoints or position");
  v.number({"height_above_terrain_m", "m", "height of the vehicle above the terrain", "heights as given"},
           config.height_above_terrain_m, {-100, 10e3});
  v.file({"file", "", "recorded positions (one of file, waypoints, position)"}, config.file);
  if (v.wants(config.file.has_value())) {
    const std::vector<std::string_view> formats(trajectory_formats().begin(), trajectory_formats().end());
    v.word(
        {"format", "",
         "csv: columns by their names; urbannav: GPS week, time of week, latitude, longitude, height; "
         "rtklib: a .pos file; nmea: GGA with RMC or ZDA; gnsslogger: the fixes in a log of Android's app; "
         "csv, gpx, kml: with times, or driven like waypoints",
         "detected from the file's content"},
        config.format, formats);
    visit_columns(v, config);
    if (v.reads() && config.file && config.format.empty())
      config.format = config.columns.empty() ? trajectory_format_of(*config.file) : "csv";
  }
  static constexpr std::array<std::string_view, 4> kAttitudes{"level", "aircraft", "multirotor", "car"};
  v.choice({"attitude", "",
            "attitude of the vehicle and its antenna: level; aircraft (nose along the path, banked in "
            "turns); multirotor (tilted by its acceleration); car (nose along the path, level across)"},
           config.attitude, kAttitudes);
  std::vector<WaypointKeys> points;
  for (std::size_t i = 0; i < config.waypoints.size() && !v.reads(); ++i)
    points.push_back({keys_of(config, i), i < config.legs.size() ? config.legs[i] : TrajectoryConfig::Leg{}});
  v.list("waypoints", points, [&](WaypointKeys& keys) {
    visit_position(v, keys.position, "corner of a drive with straight legs", kHeightNote);
    visit_leg(v, keys.leg);
    if (!v.reads()) return;
    if (keys.leg.height_above_terrain_m && config.height_above_terrain_m)
      throw v.fault("height_above_terrain_m", "is given both at the waypoint and at the trajectory",
                    "keep one: the trajectory's value follows the terrain, waypoints' values are joined by "
                    "straight lines");
    add_position(v, keys.position, frame, config, keys.leg.height_above_terrain_m.has_value());
    config.legs.push_back(keys.leg);
  });
  if (v.reads() && std::all_of(config.legs.begin(), config.legs.end(), [](const TrajectoryConfig::Leg& leg) {
        return leg == TrajectoryConfig::Leg{};
      }))
    config.legs.clear();
  const bool track =
      config.file && (config.format == "gpx" || config.format == "kml" || config.format == "csv");
  if (v.wants(track || (v.reads() ? v.has("waypoints") : !points.empty()))) {
    v.number({"speed_mps", "m/s", "speed between waypoints"}, config.speed_mps, {0, 1e4, true});
    v.number({"hold_s", "s", "time at rest at each waypoint"}, config.hold_s, {0, 1e6});
    v.number(
        {"acceleration_mps2", "m/s^2",
         "smooth drive: largest acceleration, along and across; the vehicle rests at holds and at both ends",
         "speeds and directions change instantly"},
        config.acceleration_mps2, {0, 100, true});
  }
  if (!v.wants(v.reads())) return;  // one position is written as a list of one
  v.section("position", [&] {
    PositionKeys keys;
    visit_position(v, keys, "fixed position for duration_s", kHeightNote);
    if (v.reads()) add_position(v, keys, frame, config);
  });
}

void visit_fixed(Visitor& v, std::optional<FixedPosition>& fixed, const CityConfig& city) {
  if (!v.wants(v.reads() ? v.has("fixed") : fixed.has_value())) return;
  v.section("fixed", [&] {
    PositionKeys keys;
    if (fixed && fixed->local_m) {
      keys.east_m = fixed->local_m->x(), keys.north_m = fixed->local_m->y(), keys.up_m = fixed->local_m->z();
    } else if (fixed) {
      keys.latitude_deg = options::exact_degrees(fixed->position.latitude_rad);
      keys.longitude_deg = options::exact_degrees(fixed->position.longitude_rad);
      keys.height_m = fixed->position.height_m;
    }
    visit_position(v, keys, "fixed antenna of a base station, independent of trajectory and lever_arm", "");
    if (v.reads()) fixed = position_of(v, keys, known_frame(v, city), "give the height of the base station");
  });
}

// --- time

void visit_start(Visitor& v, std::optional<GpsTime>& start, std::vector<std::string>* warnings) {
  std::optional<std::string> text;
  if (start && !v.reads()) text = geodesy::format_gpst(*start, 9);
  const bool weeks = v.is_section("start");
  if (!weeks) {
    v.text({"start", "UTC or GPST",
            "first epoch: 2019-04-28T12:58:03Z, or followed by ' GPST'. A later start skips the beginning of "
            "the trajectory. Required if the trajectory has no times",
            "the trajectory's first time"},
           text);
    if (v.reads() && text) {
      if (warnings != nullptr && !geodesy::names_time_scale(*text)) {
        warnings->push_back(
            fmt::format("start: {} has no time zone and is taken as UTC; append Z or an offset", *text));
      }
      try {
        start = geodesy::parse_simulated_time(*text);
      } catch (const InputError& e) {
        throw v.fault("start", e.problem(), e.hint());
      }
    }
  }
  if (!v.wants(weeks)) return;
  v.section("start", [&] {
    int week = 0;
    double tow = 0;
    for (const char* key : {"week", "tow"}) v.require(key, "give week and tow, such as 2051 and 46701");
    v.integer({"week", "weeks", "full GPS week, with tow instead of a date: 2051 and 46701"}, week, 0, 9999);
    v.number({"tow", "s", "seconds of that week"}, tow, {0, 604800, false, true});
    if (v.reads()) start = GpsTime::from_week(week, tow);
  });
}

void visit_rate(Visitor& v, std::optional<double>& rate_hz) {
  Range range{0, 1000, true};
  range.fraction = true;
  v.one_of({"rate_hz", "interval_s"});
  v.number({"rate_hz", "Hz", "epochs per second, also as a fraction: 1/60",
            "the trajectory's own, 1 for waypoints"},
           rate_hz, range);
  if (!v.wants(v.has("interval_s"))) return;
  std::optional<double> interval_s;
  v.number({"interval_s", "s", "seconds between epochs instead of rate_hz, in whole nanoseconds"}, interval_s,
           {1e-3, 1e6});
  if (interval_s) rate_hz = 1 / *interval_s;  // inverted again it is exact to 1e-15
}

void visit_seed(Visitor& v, std::uint64_t& seed) {
  v.integer({"seed", "", "seed of all noise: equal seeds give equal bytes"}, seed);
}

namespace {

void visit_duration(Visitor& v, std::optional<double>& duration_s) {
  v.number({"duration_s", "s", "length of the run: epochs from start to start + duration, both included",
            "the whole trajectory"},
           duration_s, {0, 1e8});
}

void visit_streets(Visitor& v, Scenario& scenario) {
  disturbance::StreetOptions streets;
  if (!scenario.receivers.empty()) streets = scenario.receivers.front().streets;
  v.part("streets", streets);
  if (!v.reads()) return;
  if (!streets.antenna_height_m) streets.antenna_height_m = scenario.trajectory.height_above_terrain_m;
  for (ReceiverConfig& receiver : scenario.receivers) receiver.streets = streets;
}

void warn_of_idle_noises(const Visitor& v, Scenario& scenario) {
  if (!v.reads()) return;
  std::vector<std::string> idle;
  for (const ReceiverConfig& receiver : scenario.receivers)
    if (has_idle_noise(scenario.sky, receiver)) idle.push_back(receiver.options.name);
  if (!idle.empty()) scenario.warnings.push_back(idle_noise_warning(idle));
}

void visit_scenario(Visitor& v, Scenario& scenario, bool trajectory_needed) {
  v.require("city", "add city: {osm: ...}, city: {mesh: ..., origin: ...}, or city: {synthetic: {}}");
  v.part("city", scenario.city);
  if (v.reads() && !v.has("sky")) scenario.sky.nominal = true;
  v.part("sky", scenario.sky);
  visit_start(v, scenario.start, &scenario.warnings);
  visit_duration(v, scenario.duration_s);
  visit_rate(v, scenario.rate_hz);
  if (v.reads() && trajectory_needed)
    v.require("trajectory", "add trajectory: {file: ...}, waypoints or position");
  v.section("trajectory", [&] { visit_trajectory(v, scenario.trajectory, scenario.city); });
  visit_receivers(v, scenario.receivers, scenario.city);
  v.part("sensors", scenario.sensors);
  visit_streets(v, scenario);
  if (v.reads() && std::any_of(scenario.receivers.begin(), scenario.receivers.end(),
                               [](const ReceiverConfig& receiver) { return has_base(receiver.options); }))
    scenario.sky.errors.enabled.set_default(true);
  warn_of_idle_noises(v, scenario);
  disturbance::visit_faults(v, scenario.faults, receiver_names(scenario.receivers));
  visit_seed(v, scenario.seed);
  visit_outputs(v, scenario.outputs);
  v.part("map", scenario.map);
  v.part("samples", scenario.samples);
  if (!v.wants(v.reads() ? v.has("live") : scenario.live.has_value())) return;
  LiveOptions live = scenario.live.value_or(LiveOptions{});
  v.part("live", live);
  if (v.reads()) scenario.live = live;
}

}  // namespace

void visit_run(Visitor& v, Scenario& scenario) {
  visit_duration(v, scenario.duration_s);
  visit_rate(v, scenario.rate_hz);
  visit_seed(v, scenario.seed);
}

void visit(Visitor& v, Scenario& scenario) {
  visit_scenario(v, scenario, true);
}
void visit(Visitor& v, ScenarioOfAnyTrajectory& o) {
  visit_scenario(v, o.scenario, false);
}

}  // namespace canyon::simulation
