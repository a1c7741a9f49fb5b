// Declared in canyon/run/scenario/scenario_fields.hpp.
// The fields of places and ways: trajectory, waypoints, fixed antennas.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/run/motion/csv_track.hpp"
#include "canyon/run/motion/recorded_path.hpp"
#include "canyon/run/motion/trajectory.hpp"
#include "canyon/run/scenario/scenario_fields.hpp"

namespace canyon::simulation {
namespace {

using geodesy::Geodetic;
using options::Range;
using options::Visitor;

constexpr Range kLocal_m{-1e6, 1e6};

struct PlaceKeys {
  std::optional<double> latitude_deg, longitude_deg, height_m, east_m, north_m, up_m;
};

PlaceKeys keys_of(const TrajectoryConfig& config, std::size_t index) {
  PlaceKeys keys;
  for (const auto& [number, enu] : config.local_waypoints) {
    if (number != index) continue;
    keys.east_m = enu.x(), keys.north_m = enu.y(), keys.up_m = enu.z();
    return keys;
  }
  const Geodetic& place = config.waypoints[index];
  keys.latitude_deg = options::exact_degrees(place.latitude_rad);
  keys.longitude_deg = options::exact_degrees(place.longitude_rad);
  keys.height_m = place.height_m;
  return keys;
}

// The city's frame, or nothing where only its file knows.
std::optional<geodesy::LocalFrame> known_frame(Visitor& v, const CityConfig& city) {
  std::optional<geodesy::LocalFrame> frame;
  if (v.reads() && city.origin) frame.emplace(*city.origin);
  return frame;
}

// A place by its keys. @param height_cure for a missing height; empty: it may be left out
FixedPlace place_of(Visitor& v, const PlaceKeys& keys, const std::optional<geodesy::LocalFrame>& frame,
                    std::string_view height_cure) {
  const auto height = [&](std::string_view key, const std::optional<double>& value) {
    if (!value && !height_cure.empty()) throw v.fault({}, fmt::format("'{}' is missing", key), height_cure);
    return value.value_or(0);
  };
  FixedPlace place;
  if (keys.east_m || keys.north_m || keys.up_m) {
    constexpr std::string_view kCure =
        "east_m, north_m and up_m are one place, latitude_deg, longitude_deg and height_m another";
    v.require("east_m", kCure);
    v.require("north_m", kCure);
    place.local_m = Eigen::Vector3d(*keys.east_m, *keys.north_m, height("up_m", keys.up_m));
    if (frame) place.place = frame->geodetic_from_local(*place.local_m);
  } else {
    v.require("latitude_deg");
    v.require("longitude_deg");
    place.place =
        Geodetic::from_degrees(*keys.latitude_deg, *keys.longitude_deg, height("height_m", keys.height_m));
  }
  return place;
}

// A place becomes the next waypoint.
void add_place(Visitor& v, const PlaceKeys& keys, const std::optional<geodesy::LocalFrame>& frame,
               TrajectoryConfig& config, bool on_terrain = false) {
  const FixedPlace place = place_of(
      v, keys, frame,
      on_terrain || config.height_above_terrain_m ? "" : "give it, or trajectory.height_above_terrain_m");
  if (place.local_m) config.local_waypoints.emplace_back(config.waypoints.size(), *place.local_m);
  config.waypoints.push_back(place.place);
}

// `height_note`: behind the help of heights.
void visit_place(Visitor& v, PlaceKeys& keys, const std::string& what, const std::string& height_note) {
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
  PlaceKeys place;
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
         "rtklib: "
         "a .pos file; nmea: GGA with RMC or ZDA; gnsslogger: the fixes in a log of Android's app; csv, gpx, "
         "kml: with times, or driven as waypoints are",
         "told by the file's content"},
        config.format, formats);
    visit_columns(v, config);
    if (v.reads() && config.file && config.format.empty())
      config.format = config.columns.empty() ? trajectory_format_of(*config.file) : "csv";
  }
  static constexpr std::array<std::string_view, 4> kAttitudes{"level", "aircraft", "multirotor", "car"};
  v.choice({"attitude", "",
            "attitude of the vehicle and its antenna: level; aircraft (nose along the path, banked in "
            "turns); multirotor (tilted by its acceleration); car (nose along the way, level across)"},
           config.attitude, kAttitudes);
  std::vector<WaypointKeys> places;
  for (std::size_t i = 0; i < config.waypoints.size() && !v.reads(); ++i) {
    places.push_back({keys_of(config, i), i < config.legs.size() ? config.legs[i] : TrajectoryConfig::Leg{}});
  }
  v.list("waypoints", places, [&](WaypointKeys& keys) {
    visit_place(v, keys.place, "corner of a drive with straight legs", kHeightNote);
    visit_leg(v, keys.leg);
    if (!v.reads()) return;
    if (keys.leg.height_above_terrain_m && config.height_above_terrain_m) {
      throw v.fault(
          "height_above_terrain_m", "is given at the waypoint and at the trajectory",
          "keep one: the trajectory's follows the terrain, waypoints' are joined by straight lines");
    }
    add_place(v, keys.place, frame, config, keys.leg.height_above_terrain_m.has_value());
    config.legs.push_back(keys.leg);
  });
  if (v.reads() && std::all_of(config.legs.begin(), config.legs.end(), [](const TrajectoryConfig::Leg& leg) {
        return leg == TrajectoryConfig::Leg{};
      })) {
    config.legs.clear();
  }
  const bool track =
      config.file && (config.format == "gpx" || config.format == "kml" || config.format == "csv");
  if (v.wants(track || (v.reads() ? v.has("waypoints") : !places.empty()))) {
    v.number({"speed_mps", "m/s", "speed between waypoints"}, config.speed_mps, {0, 1e4, true});
    v.number({"hold_s", "s", "time at rest at each waypoint"}, config.hold_s, {0, 1e6});
    v.number(
        {"acceleration_mps2", "m/s^2",
         "smooth drive: largest acceleration, along and across; the vehicle rests at holds and at both ends",
         "speeds and directions change at once"},
        config.acceleration_mps2, {0, 100, true});
  }
  if (!v.wants(v.reads())) return;  // one place is written as a list of one
  v.section("position", [&] {
    PlaceKeys keys;
    visit_place(v, keys, "fixed position for duration_s", kHeightNote);
    if (v.reads()) add_place(v, keys, frame, config);
  });
}

void visit_fixed(Visitor& v, std::optional<FixedPlace>& fixed, const CityConfig& city) {
  if (!v.wants(v.reads() ? v.has("fixed") : fixed.has_value())) return;
  v.section("fixed", [&] {
    PlaceKeys keys;
    if (fixed && fixed->local_m) {
      keys.east_m = fixed->local_m->x(), keys.north_m = fixed->local_m->y(), keys.up_m = fixed->local_m->z();
    } else if (fixed) {
      keys.latitude_deg = options::exact_degrees(fixed->place.latitude_rad);
      keys.longitude_deg = options::exact_degrees(fixed->place.longitude_rad);
      keys.height_m = fixed->place.height_m;
    }
    visit_place(v, keys, "fixed antenna of a base station, independent of trajectory and lever_arm", "");
    if (v.reads()) fixed = place_of(v, keys, known_frame(v, city), "a base station's place needs a height");
  });
}

}  // namespace canyon::simulation
