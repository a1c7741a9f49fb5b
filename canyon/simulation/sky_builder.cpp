#include "canyon/simulation/sky_builder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/cached_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"
#include "canyon/sky/orbit/precise_sky.hpp"
#include "canyon/sky/orbit/sky.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"

namespace canyon::simulation {
namespace {

using geodesy::format_gpst;
using geodesy::GpsTime;

std::string span_text(GpsTime begin, GpsTime end) {
  return begin == end ? format_gpst(begin, 0)
                      : fmt::format("{} to {}", format_gpst(begin, 0), format_gpst(end, 0));
}

std::string list_text(const std::vector<gnss::SatelliteId>& ids) {
  constexpr std::size_t kMax = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(ids.size(), kMax); ++i)
    text += fmt::format("{}{}", i == 0 ? "" : " ", to_string(ids[i]));
  if (ids.size() > kMax) text += fmt::format(" and {} more", ids.size() - kMax);
  return text;
}

// Instants that represent the run: both ends, and between them every ten minutes (an ephemeris is valid for
// longer) but at most a thousand.
std::vector<GpsTime> probes(GpsTime begin, GpsTime end) {
  const double span = end - begin;
  const int steps = static_cast<int>(std::clamp(span / 600, 1.0, 1000.0));
  std::vector<GpsTime> times;
  times.reserve(static_cast<std::size_t>(steps) + 1);
  for (int i = 0; i < steps; ++i) times.push_back(begin + span * i / steps);
  times.push_back(end);
  return times;
}

std::size_t count_states(const orbit::Sky& sky, const std::vector<gnss::SatelliteId>& ids, GpsTime t) {
  return static_cast<std::size_t>(std::count_if(
      ids.begin(), ids.end(), [&](gnss::SatelliteId id) { return sky.state(id, t).has_value(); }));
}

// Checks all probes: no satellite at the start is an error, none later a warning.
void check_coverage(const orbit::Sky& sky, GpsTime begin, GpsTime end, std::string_view what,
                    const std::pair<GpsTime, GpsTime>& span, std::string_view hint, ReadReport& report) {
  const std::vector<gnss::SatelliteId> ids = sky.satellites();
  if (count_states(sky, ids, begin) == 0) {
    const auto unhealthy = [&](gnss::SatelliteId id) {
      return sky.health(id, begin) == orbit::SatelliteHealth::Unhealthy;
    };
    if (std::any_of(ids.begin(), ids.end(), unhealthy)) {
      throw InputError(fmt::format("no satellite can be used at {}: those with an ephemeris are unhealthy",
                                   format_gpst(begin, 0)),
                       "give navigation files with healthy satellites");
    }
    if (span.first <= begin && begin <= span.second) {
      throw InputError(fmt::format("no satellite has {} at {}: a gap in their span ({})", what,
                                   format_gpst(begin, 0), span_text(span.first, span.second)),
                       hint);
    }
    throw InputError(
        fmt::format("the requested time ({}) is outside the {} ({}){}", span_text(begin, end), what,
                    span_text(span.first, span.second), geodesy::rollover_text(begin, span.second)),
        hint);
  }
  const std::vector<GpsTime> times = probes(begin, end);
  for (const GpsTime t : times) {
    if (count_states(sky, ids, t) > 0) continue;
    report.add_line(ReadReport::Level::Guess,
                    fmt::format("the {} ({}) do not cover the whole run: none is valid at {}", what,
                                span_text(span.first, span.second), format_gpst(t, 0)));
    break;
  }
}

// Warns of satellites at impossible distances, since readers do not check positions.
void check_distances(const orbit::Sky& sky, GpsTime begin, GpsTime end, ReadReport& report) {
  constexpr double kNearest_m = 6.5e6, kFarthest_m = 60e6;  // from the Earth's centre
  std::vector<gnss::SatelliteId> wrong;
  std::string first;
  for (const gnss::SatelliteId id : sky.satellites()) {
    for (const GpsTime t : probes(begin, end)) {
      const auto state = sky.state(id, t);
      const double distance_m = state ? state->position_m.norm() : kNearest_m;
      if (distance_m >= kNearest_m && distance_m <= kFarthest_m) continue;
      if (wrong.empty())
        first = fmt::format("{} is at {:.6g} km at {}", to_string(id), distance_m / 1e3, format_gpst(t, 0));
      wrong.push_back(id);
      break;
    }
  }
  if (wrong.empty()) return;
  report.add_line(
      ReadReport::Level::Guess,
      fmt::format("{} satellites are not 6,500 to 60,000 km from the Earth's centre ({}): {}; check "
                  "the positions and their unit",
                  wrong.size(), list_text(wrong), first));
}

// Satellites above the horizon at `position` that cannot be used: unhealthy, or without a valid ephemeris
// during the whole run. Stale ephemerides are accurate enough for their directions.
void report_unusable(const orbit::BroadcastSky& sky, const SkyConfig& config, GpsTime begin, GpsTime end,
                     const geodesy::Geodetic& position, ReadReport& report) {
  constexpr double kWellAboveHorizon_rad = 0.0873;  // 5 deg
  const orbit::BroadcastSky any(sky.data(), {config.systems, true, true});
  const Eigen::Vector3d ecef = geodesy::ecef_from_geodetic(position);
  const std::vector<GpsTime> times = probes(begin, end);
  std::vector<gnss::SatelliteId> silent;
  for (const gnss::SatelliteId id : sky.satellites()) {
    if (std::any_of(times.begin(), times.end(), [&](GpsTime t) { return sky.state(id, t).has_value(); }))
      continue;
    const auto line = orbit::line_of_sight(any, id, begin, ecef);
    if (line && line->elevation_rad > kWellAboveHorizon_rad) silent.push_back(id);
  }
  if (silent.empty()) return;
  // By the reason: "unhealthy (health 63)" of each, else an example.
  std::map<std::string, std::vector<gnss::SatelliteId>> by_reason;
  for (const gnss::SatelliteId id : silent) by_reason[sky.health_text(id, begin)].push_back(id);
  std::vector<std::string> groups;
  groups.reserve(by_reason.size());
  for (const auto& [reason, ids] : by_reason) {
    groups.push_back(
        fmt::format("{}: {}", list_text(ids), reason.empty() ? sky.source(ids.front(), begin) : reason));
  }
  report.add_line(ReadReport::Level::Guess,
                  fmt::format("{} satellites above the horizon at the start are left out ({})", silent.size(),
                              fmt::join(groups, "; ")));
}

void check_systems(const orbit::Sky& sky, const std::set<gnss::System>& wanted, ReadReport& report) {
  if (wanted == SkyConfig().systems) return;  // the default selection
  const std::vector<gnss::SatelliteId> ids = sky.satellites();
  for (const gnss::System system : wanted) {
    if (std::any_of(ids.begin(), ids.end(), [system](gnss::SatelliteId id) { return id.system == system; }))
      continue;
    report.add_line(ReadReport::Level::Guess, fmt::format("the sky has no {} satellite", gnss::name(system)));
  }
}

// Warns of ephemerides that are used only because of allow_stale.
void report_stale(const orbit::BroadcastSky& sky, const SkyConfig& config, GpsTime begin, GpsTime end,
                  ReadReport& report) {
  const orbit::BroadcastSky strict(sky.data(), {config.systems, false});
  std::vector<gnss::SatelliteId> stale;
  std::string example;
  for (const gnss::SatelliteId id : sky.satellites()) {
    for (const GpsTime t : probes(begin, end)) {
      if (!sky.state(id, t) || strict.state(id, t)) continue;
      if (stale.empty()) example = sky.source(id, t);
      stale.push_back(id);
      break;
    }
  }
  if (stale.empty()) return;
  report.add_line(
      ReadReport::Level::Guess,
      fmt::format("allow_stale: {} satellites use ephemerides older than their system allows: {} ({}: {})",
                  stale.size(), list_text(stale), to_string(stale.front()), example));
}

BuiltSky from_navigation(const SkyConfig& config, GpsTime begin, GpsTime end,
                         const geodesy::Geodetic& position) {
  BuiltSky built;
  built.navigation = rinex::read_rinex_navigation(config.navigation, config.systems);
  built.report = built.navigation.report;
  // Most receivers do not measure ranges to SBAS: it is used only if listed.
  if (config.systems.count(gnss::System::SBAS) == 0) built.navigation.sbas.clear();
  auto sky = std::make_shared<orbit::BroadcastSky>(
      built.navigation, orbit::BroadcastOptions{config.systems, config.allow_stale});
  check_systems(*sky, config.systems, built.report);
  check_coverage(*sky, begin, end, "ephemerides", sky->span(),
                 config.allow_stale
                     ? "give the navigation files of that day; all in these are unhealthy"
                     : "give the navigation files of that day, or use old ones: sky.allow_stale: true in a "
                       "scenario, --allow-stale in canyon rtk and canyon sky",
                 built.report);
  check_distances(*sky, begin, end, built.report);
  report_unusable(*sky, config, begin, end, position, built.report);
  if (config.allow_stale) report_stale(*sky, config, begin, end, built.report);
  built.sky = std::move(sky);
  return built;
}

BuiltSky from_sp3(const SkyConfig& config, GpsTime begin, GpsTime end) {
  BuiltSky built;
  auto sky = std::make_shared<orbit::PreciseSky>(config.sp3, config.systems);
  built.report = sky->report();
  check_systems(*sky, config.systems, built.report);
  check_coverage(*sky, begin, end, "precise orbits", sky->span(),
                 "give the orbits of that day or another start", built.report);
  check_distances(*sky, begin, end, built.report);
  built.sky = std::move(sky);
  return built;
}

BuiltSky build(const SkyConfig& config, GpsTime begin, GpsTime end, const geodesy::Geodetic& position) {
  if (!config.navigation.empty()) return from_navigation(config, begin, end, position);
  if (!config.sp3.empty()) return from_sp3(config, begin, end);
  BuiltSky built;
  if (!config.frozen_azimuth_rad.empty()) {
    built.sky =
        std::make_shared<orbit::FrozenSky>(position, config.frozen_azimuth_rad, config.frozen_elevation_rad);
    return built;
  }
  // Signals leave their satellites before they arrive: the records begin slightly before the run.
  built.navigation = orbit::nominal_constellation(begin - 1.0, end + 1.0, config.systems);
  if (config.errors.solar_flux_sfu && config.has_errors(true))
    built.navigation.klobuchar[gnss::System::GPS] = orbit::standard_ionosphere(*config.errors.solar_flux_sfu);
  auto sky = std::make_shared<orbit::BroadcastSky>(built.navigation, orbit::BroadcastOptions{config.systems});
  check_systems(*sky, config.systems, built.report);
  built.sky = std::move(sky);
  return built;
}

// Adds a standard ionosphere for the solar flux to a sky whose files have no coefficients.
void add_ionosphere(const SkyConfig& config, GpsTime begin, BuiltSky& sky) {
  auto& klobuchar = sky.navigation.klobuchar;
  const std::optional<double>& given_sfu = config.errors.solar_flux_sfu;
  if (!klobuchar.empty()) {
    if (given_sfu && !config.navigation.empty())
      sky.report.add_line(
          ReadReport::Level::Guess,
          "sky.errors.solar_flux_sfu has no effect: the navigation files have coefficients of the "
          "ionosphere");
    return;
  }
  if (!config.has_errors(!sky.navigation.empty())) return;
  const double flux_sfu = given_sfu.value_or(orbit::mean_solar_flux_sfu(begin));
  klobuchar[gnss::System::GPS] = orbit::standard_ionosphere(flux_sfu);
  sky.report.add_line(
      ReadReport::Level::Guess,
      fmt::format("the ionosphere is a standard one for a solar flux of {:.0f} sfu, since the files "
                  "have no coefficients; sky.errors.solar_flux_sfu sets another",
                  flux_sfu));
}

}  // namespace

BuiltSky build_sky(const SkyConfig& config, GpsTime begin, GpsTime end, const geodesy::Geodetic& position) {
  BuiltSky sky = build(config, begin, end, position);
  if (config.frozen_azimuth_rad.empty()) sky.sky = std::make_shared<orbit::CachedSky>(std::move(sky.sky));
  add_ionosphere(config, begin, sky);
  return sky;
}

bool has_satellites(const orbit::Sky& sky, GpsTime t) {
  const std::vector<gnss::SatelliteId> ids = sky.satellites();
  return std::any_of(ids.begin(), ids.end(), [&](gnss::SatelliteId id) { return sky.state(id, t); });
}

void require_satellites(const orbit::Sky& sky, std::span<const GpsTime> times) {
  for (std::size_t i = 0; i < times.size(); ++i) {
    if ((i > 0 && times[i] == times[i - 1]) || has_satellites(sky, times[i])) continue;
    throw InputError(fmt::format("no satellite has an ephemeris at {}", geodesy::format_utc(times[i], 0)),
                     "give times near those of the sky's ephemerides, or ephemerides of that day");
  }
}

std::shared_ptr<const sky::RangeErrorModel> make_range_errors(const SkyConfig& config, const BuiltSky& sky,
                                                              std::uint64_t seed) {
  if (!config.has_errors(!sky.navigation.empty())) return nullptr;
  sky::RangeErrorOptions options = config.errors;
  // Receivers use the precise orbits as well.
  if (!config.sp3.empty()) options.orbit_clock_m.clear();
  return std::make_shared<const sky::RangeErrorModel>(options, seed, sky.sky->satellites(),
                                                      sky.navigation.klobuchar);
}

Environment make_environment(std::shared_ptr<CityScene> scene, const BuiltSky& sky, const SkyConfig& config,
                             std::uint64_t seed) {
  Environment environment(std::move(scene), sky.sky, sky.navigation.klobuchar);
  environment.set_errors(sky.errors && sky.errors_seed == seed ? sky.errors
                                                               : make_range_errors(config, sky, seed));
  return environment;
}

void decide_options(receiver::ReceiverOptions& options, const sky::RangeErrorModel* errors,
                    const orbit::Sky* sky) {
  options.decide(errors != nullptr, errors != nullptr && errors->has_ionosphere());
  if (sky == nullptr) return;
  try {
    options.choose_signals(sky->satellites());
  } catch (const InputError& e) {
    throw InputError(fmt::format("receiver '{}': {}", options.name, e.problem()), e.hint());
  }
}

void require_ionosphere(const BuiltSky& sky) {
  const auto& klobuchar = sky.navigation.klobuchar;
  if (klobuchar.count(gnss::System::GPS) != 0) return;
  for (const gnss::SatelliteId id : sky.sky->satellites()) {
    if (klobuchar.count(id.system) != 0) continue;
    throw InputError(fmt::format("the sky has no ionosphere coefficients for {}", gnss::name(id.system)),
                     "give a navigation file whose header has GPSA and GPSB, or switch the receivers' "
                     "ionosphere and correct_ionosphere off");
  }
}

}  // namespace canyon::simulation
