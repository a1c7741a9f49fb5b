#include "canyon/run/scenario/scenario_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/city.hpp"
#include "canyon/run/scenario/profile.hpp"
#include "canyon/run/scenario/scenario.hpp"

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
// -----------------------------------------------------------------------------------------------------

void visit_frozen(Visitor& v, SkyConfig& sky) {
  if (v.reads() && !(v.has("satAzimuth") && v.has("satElevation"))) {
    throw v.fault({}, "frozen needs satAzimuth and satElevation", "give lists of radians");
  }
  int count = static_cast<int>(sky.frozen_azimuth_rad.size());
  std::vector<double>& azimuths = sky.frozen_azimuth_rad;
  std::vector<double>& elevations = sky.frozen_elevation_rad;
  v.integer({"satNum", "satellites", "the paper's virtual satellites that never move", "the lists' length"},
            count, 1, 63);
  v.numbers({"satAzimuth", "rad", "their azimuths from north, clockwise"}, azimuths, {});
  v.numbers({"satElevation", "rad", "their elevations"}, elevations, {});
  if (!v.reads()) return;
  const auto in_radians = [&v](const char* key, const std::vector<double>& values, double low, double high) {
    for (const double value : values) {
      // 1.5708 means the zenith.
      if (value >= low - 1e-5 && value <= high + 1e-5) continue;
      throw v.fault(key, fmt::format("{} is out of range", value),
                    fmt::format("it is in radians, from {:.6g} to {:.6g}; {} deg is {:.6f}", low, high, value,
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
        throw v.fault("systems", e.problem(), e.cure());
      }
    }
  }
  if (systems.empty())
    throw v.fault("systems", "names no system", "write GPS, GLONASS, Galileo, BeiDou, QZSS, SBAS");
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
      throw v.fault("nominal", "false, and no other source",
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

// --- time
// ----------------------------------------------------------------------------------------------------

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
        warnings->push_back(fmt::format(
            "start: {} names no zone and is taken as UTC; write Z or an offset behind it", *text));
      }
      try {
        start = geodesy::parse_simulated_time(*text);
      } catch (const InputError& e) {
        throw v.fault("start", e.problem(), e.cure());
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
  if (interval_s) rate_hz = 1 / *interval_s;  // its inverse again is right to 1e-15
}

void visit_seed(Visitor& v, std::uint64_t& seed) {
  v.integer({"seed", "", "seed of all noise: same seed, same bytes"}, seed);
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
  if (v.reads() && trajectory_needed) {
    v.require("trajectory", "add trajectory: {file: ...}, waypoints or position");
  }
  v.section("trajectory", [&] { visit_trajectory(v, scenario.trajectory, scenario.city); });
  visit_receivers(v, scenario.receivers, scenario.city);
  v.part("sensors", scenario.sensors);
  visit_streets(v, scenario);
  if (v.reads() && std::any_of(scenario.receivers.begin(), scenario.receivers.end(),
                               [](const ReceiverConfig& receiver) { return has_base(receiver.options); })) {
    scenario.sky.errors.enabled.set_default(true);
  }
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
