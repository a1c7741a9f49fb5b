#include "cli/site.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "cli/commands.hpp"
#include "cli/scenario_run.hpp"

namespace canyon::cli {
namespace {

/// Rays are exact within this distance of a city (RayScene).
constexpr double kFarFromCity_m = 10'000;

Eigen::Vector3d parse_enu(const std::string& text) {
  const std::vector<double> values = parse_numbers(text);
  const bool finite = std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  if (values.size() != 3 || !finite) {
    throw InputError(fmt::format("--enu '{}' is not a position", text),
                     "give EAST,NORTH,UP in metres, e.g. 10,-5,2");
  }
  return {values[0], values[1], values[2]};
}

/// A position in the wrong order or for another city would show an empty field.
void check_near_city(const Eigen::Vector3d& enu, const city::City& city, const char* option) {
  if (city.mesh.triangles.empty()) return;
  const city::Box box = city.bounds();
  const double away = (box.min - enu).cwiseMax(enu - box.max).cwiseMax(0.0).norm();
  if (!(away <= kFarFromCity_m)) {
    throw InputError(fmt::format("{} is {:.1f} km away from the city '{}'", option, away / 1e3, city.name),
                     fmt::format("its origin is latitude {:.6f}, longitude {:.6f}",
                                 geodesy::degrees(city.frame.origin().latitude_rad),
                                 geodesy::degrees(city.frame.origin().longitude_rad)));
  }
}

}  // namespace

void add_site_options(Command& command, SiteArguments& arguments) {
  add_scenario_file(command, arguments.scenario, "scenario file: its city, sky and propagation");
  command.add_option("--at", arguments.area, "LAT,LON,HEIGHT", "antenna (degrees, ellipsoidal metres)");
  command.add_option("--enu", arguments.enu, "E,N,U", "antenna in the city's frame [m]").excludes("--at");
  command.add_option("--time", arguments.time, "T",
                     "time in UTC, or followed by ' GPST' (the scenario's first epoch)");
  command.add_option("--receiver", arguments.receiver, "NAME",
                     "receiver whose propagation and antenna are used (the first)");
}

Site::Site(const SiteArguments& arguments) {
  if (!arguments.enu.empty()) enu_ = parse_enu(arguments.enu);
  if (!arguments.area.empty()) position_ = parse_position(arguments.area, "--at");
  std::optional<geodesy::GpsTime> time;
  if (!arguments.time.empty()) time = parse_instant(arguments.time);
  const simulation::Scenario scenario = simulation::read_scenario(arguments.scenario);
  receiver_ =
      for_option("--receiver", [&] { return simulation::find_receiver(scenario, arguments.receiver); });
  simulation_ = make_ready(scenario, arguments.scenario).simulation;
  time_ = time.value_or(simulation_->begin());
  if (is_position_given()) check_near_city(antenna(time_), environment().city(), enu_ ? "--enu" : "--at");
  if (!time) return;
  cover(time_, time_);
  check_time(time_, "--time");
}

geodesy::GpsTime Site::end() const {
  return begin() + simulation_->interval_s() * static_cast<double>(simulation_->epoch_count() - 1);
}

void Site::cover(geodesy::GpsTime from, geodesy::GpsTime to) {
  const simulation::SkyConfig& sky = simulation_->scenario().sky;
  const bool nominal = sky.navigation.empty() && sky.sp3.empty() && sky.frozen_azimuth_rad.empty();
  if (!nominal || (begin() <= from && to <= end())) return;
  const simulation::Environment& known = simulation_->environment();
  simulation::BuiltSky built = simulation::build_sky(sky, from, to, known.city().frame.origin());
  wider_.emplace(known.under(std::move(built.sky), std::move(built.navigation.klobuchar)));
}

const simulation::ReceiverConfig& Site::receiver_config() const {
  return simulation_->scenario().receivers[receiver_];
}

Eigen::Vector3d Site::antenna(geodesy::GpsTime t) const {
  if (enu_) return *enu_;
  return environment().city().frame.local_from_geodetic(
      position_ ? *position_ : simulation_->antenna_pose(receiver_, t).position);
}

propagation::Propagator Site::make_propagator() const {
  return environment().make_propagator(receiver_config().propagation);
}

void Site::check_time(geodesy::GpsTime t, const std::string& option) const {
  if (!simulation::has_satellites(environment().sky(), t)) {
    throw InputError(
        fmt::format("{}: no satellite has an ephemeris at {}", option, geodesy::format_gpst(t, 0)),
        fmt::format(
            "the scenario's sky is for {}; give a time near that, or ephemerides of the requested day",
            geodesy::format_gpst(simulation_->begin(), 0)));
  }
  const simulation::Trajectory& drive = simulation_->trajectory();
  if (!is_position_given() && drive.length_m() > 0 && (t < drive.begin() || t > drive.end())) {
    print_warnings({fmt::format("{}: the drive lasts from {} to {}; the antenna is at its {}", option,
                                geodesy::format_gpst(drive.begin(), 0), geodesy::format_gpst(drive.end(), 0),
                                t < drive.begin() ? "beginning" : "end")});
  }
}

}  // namespace canyon::cli
