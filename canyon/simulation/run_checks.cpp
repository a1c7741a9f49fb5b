#include "canyon/simulation/run_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/magnetic_field.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/raytrace/ray_scene.hpp"
#include "canyon/relative/correction_link.hpp"
#include "canyon/simulation/run_plan.hpp"
#include "canyon/simulation/scenario/receiver_bases.hpp"
#include "canyon/simulation/scenario_trajectory.hpp"
#include "canyon/simulation/sensors/vehicle_sensors.hpp"

namespace canyon::simulation {
namespace {

using geodesy::format_gpst;
using geodesy::Geodetic;
using geodesy::GpsTime;

// A trajectory that is farther from the city has a wrong origin.
constexpr double kFarFromCity_m = 10e3;
// Masks below this, but not 0, are more likely radians: 0.17 rad are 10 deg.
constexpr double kLeastMask_deg = 1;
// A recorded path that is never lower above the ground is one of an aircraft, or of another zero of heights:
// undulations of the geoid begin to matter there.
constexpr double kNoVehicle_m = 20;
// Civil receivers end their service above 1,000 knots (the export limit of the Missile Technology Control
// Regime's annex, item 11.A.3: 600 m/s; receivers keep to the older 1,000 knots).
constexpr double kFastest_mps = 515;

// Horizontal distance [m] from a point to the city's bounds; 0 inside.
double distance_to(const city::Box& box, const Eigen::Vector3d& point) {
  const Eigen::Vector2d p = point.head<2>();
  const Eigen::Vector2d nearest = p.cwiseMax(box.min.head<2>()).cwiseMin(box.max.head<2>());
  return (p - nearest).norm();
}

void check_ionosphere(const Scenario& scenario, const BuiltSky& sky) {
  const bool needed =
      std::any_of(scenario.receivers.begin(), scenario.receivers.end(), [](const ReceiverConfig& receiver) {
        return receiver.options.ionosphere || receiver.options.fix.correct_ionosphere;
      });
  if (!needed) return;
  try {
    require_ionosphere(sky);
  } catch (const InputError& e) {
    throw scenario_error(scenario, e.problem(), e.cure());
  }
}

void check_streams(const Scenario& scenario) {
  for (const ReceiverConfig& receiver : scenario.receivers) {
    const std::string& from = receiver.options.corrections.from;
    if (!relative::is_stream(from)) continue;
    throw scenario_error(
        scenario,
        fmt::format("receiver '{}' takes corrections from '{}', a stream", receiver.options.name, from),
        from.starts_with(relative::kTopicAddress)
            ? "run it as a node of ROS 2 (docs/ros2.md), or name a base of the scenario"
            : "run it by canyon live, or name a base of the scenario");
  }
}

void check_all_sensors(const RunView& run, std::vector<std::string>& warnings) {
  const Scenario& scenario = run.scenario;
  if (scenario.outputs.has("highres_imu") && !scenario.sensors.any()) {
    throw scenario_error(scenario, "outputs.highres_imu has no sensors to write",
                         "add sensors: {imu: {profile: consumer}}");
  }
  if (scenario.sensors.magnetometer && !geodesy::magnetic_model_is_valid(run.plan.begin)) {
    warnings.emplace_back(
        "sensors.magnetometer: the World Magnetic Model 2025 is for 2025 to 2030; outside it is off by more: "
        "0.1 uT in 2019, 0.3 uT in 2012");
  }
  for (const ReceiverConfig& receiver : scenario.receivers) {
    try {
      check_sensors(scenario.sensors, receiver);
    } catch (const InputError& e) {
      throw scenario_error(scenario, e.problem(), e.cure());
    }
  }
}

// Along the ground [m].
double distance_to(const Geodetic& origin, Geodetic place) {
  place.height_m = origin.height_m;
  return (geodesy::ecef_from_geodetic(place) - geodesy::ecef_from_geodetic(origin)).norm();
}

InputError far_error(const RunView& run, double distance, const Geodetic& place, GpsTime t) {
  const city::City& city = run.environment.city();
  return scenario_error(
      run.scenario,
      fmt::format(
          "the trajectory is {:.1f} km away from the city '{}' (at latitude {:.6f}, longitude {:.6f}, {})",
          distance / 1e3, city.name, geodesy::degrees(place.latitude_rad),
          geodesy::degrees(place.longitude_rad), format_gpst(t, 0)),
      fmt::format(
          "check city.origin (now latitude {:.6f}, longitude {:.6f}), and that the trajectory's angles "
          "are degrees in the order of its format",
          geodesy::degrees(city.frame.origin().latitude_rad),
          geodesy::degrees(city.frame.origin().longitude_rad)));
}

void check_near(const RunView& run, const city::Box& bounds, const Geodetic& place, GpsTime t) {
  const city::City& city = run.environment.city();
  if (city.mesh.triangles.empty()) return;
  const double distance = distance_to(bounds, city.frame.local_from_geodetic(place));
  if (distance > kFarFromCity_m) throw far_error(run, distance, place, t);
}

// A flight may lead far over an open field, but hardly passes it by from its begin to its end. Nothing but
// the frame of local places depends on the field's origin.
void check_near_field(const RunView& run, std::size_t step, std::vector<std::string>& warnings) {
  if (!run.scenario.city.is<OpenField>() || !run.scenario.city.origin) return;
  const RunPlan& plan = run.plan;
  for (std::size_t k = 0; k < plan.epochs(); k += step) {
    if (distance_to(*run.scenario.city.origin, plan.trajectory.at(plan.at(k)).position) <= kFarFromCity_m) {
      return;
    }
  }
  const Geodetic place = plan.trajectory.at(plan.begin).position;
  const InputError far = far_error(run, distance_to(*run.scenario.city.origin, place), place, plan.begin);
  warnings.push_back(far.problem() + ": " + far.cure());
}

// Checks up to two thousand epochs of the trajectory: distance to the city, height, terrain below, speed.
void check_places(const RunView& run, std::vector<std::string>& warnings) {
  const RunPlan& plan = run.plan;
  const std::size_t step = std::max<std::size_t>(1, plan.epochs() / 2000);
  const city::Box bounds = run.environment.city().bounds();
  check_near_field(run, step, warnings);
  bool fast = false;
  double lowest_m = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < plan.epochs(); k += step) {
    const Pose pose = plan.trajectory.at(plan.at(k));
    const double speed_mps = pose.velocity_enu_mps.norm();
    if (speed_mps > kFastest_mps && !std::exchange(fast, true)) {
      warnings.push_back(fmt::format(
          "the trajectory moves at {:.0f} m/s ({}): faster than civil receivers work, 515 m/s (1,000 knots)",
          speed_mps, format_gpst(plan.at(k), 0)));
    }
    check_near(run, bounds, pose.position, plan.at(k));
    lowest_m = std::min(lowest_m, run.environment.scene().height_above_ground(
                                      run.environment.city().frame.local_from_geodetic(pose.position)));
    if (run.scenario.trajectory.height_above_terrain_m) {
      (void)vehicle_pose(run.scenario, plan.trajectory, run.environment, plan.at(k));
    }
  }
  const TrajectoryConfig& trajectory = run.scenario.trajectory;
  if (trajectory.file && !trajectory.height_above_terrain_m && !run.scenario.city.is<OpenField>() &&
      lowest_m > kNoVehicle_m) {
    warnings.push_back(fmt::format(
        "the recorded path is nowhere lower than {:.0f} m above the city's ground: if the vehicle drives, "
        "its heights and the city's have different zeros (a map without terrain has its ground at height 0); "
        "trajectory.height_above_terrain_m: 1.5 puts it on the ground",
        lowest_m));
  }
}

// A fixed receiver may stand beyond the city, under an open sky.
void check_fixed(const RunView& run, std::vector<std::string>& warnings) {
  constexpr double kFarFromVehicle_m = 100e3;
  const Geodetic vehicle = run.plan.trajectory.at(run.plan.begin).position;
  for (std::size_t r = 0; r < run.scenario.receivers.size(); ++r) {
    const ReceiverConfig& receiver = run.scenario.receivers[r];
    if (!receiver.fixed) continue;
    const AntennaState antenna =
        antenna_state(Pose{run.plan.begin, receiver.fixed->place}, run.environment.city().frame);
    const double distance_m = distance_to(vehicle, receiver.fixed->place);
    const std::string where = fmt::format("receivers[{}].fixed: '{}' stands {:.0f} km from the trajectory", r,
                                          receiver.options.name, distance_m / 1e3);
    if (!is_possible(antenna)) {
      throw scenario_error(run.scenario, where + ", and farther than 10000 km from the city",
                           "check its latitude and longitude");
    }
    if (distance_m > kFarFromVehicle_m) warnings.push_back(where + ": check its latitude and longitude");
  }
}

// The way [m] to the horizon of waves, whose bend makes the Earth's radius 4/3 of its own.
double horizon_m(double height_m) {
  constexpr double kRadius_m = 4.0 / 3 * 6371e3;
  return std::sqrt(2 * kRadius_m * std::max(0.0, height_m));
}

void check_transmitter(const RunView& run, const disturbance::Fault& fault,
                       std::vector<std::string>& warnings) {
  const disturbance::CourseOptions* course = fault.settings->course();
  if (course == nullptr || !course->given()) return;
  constexpr double kSpare_m = 20e3;
  const geodesy::LocalFrame& frame = run.environment.city().frame;
  const GpsTime t = run.plan.begin + fault.from_s;
  const Eigen::Vector3d from = disturbance::Course(*course, frame, t).at(t);
  const Geodetic vehicle = run.plan.trajectory.at(t).position;
  const double distance_m = (from - frame.local_from_geodetic(vehicle)).norm();
  const double seen_m = horizon_m(frame.geodetic_from_local(from).height_m) + horizon_m(vehicle.height_m);
  if (distance_m <= seen_m + kSpare_m) return;
  warnings.push_back(
      fmt::format("fault '{}': its transmitter is {:.0f} km from the trajectory, beyond the "
                  "horizon: check its latitude and longitude",
                  fault.name, distance_m / 1e3));
}

std::size_t count_above(const RunView& run, const Geodetic& place, double elevation_rad) {
  const std::vector<gnss::SatelliteId> ids = run.sky.sky->satellites();
  return static_cast<std::size_t>(std::count_if(ids.begin(), ids.end(), [&](gnss::SatelliteId id) {
    const auto line =
        orbit::line_of_sight(*run.sky.sky, id, run.plan.begin, geodesy::ecef_from_geodetic(place));
    return line && line->elevation_rad >= elevation_rad;
  }));
}

void check_masks(const RunView& run, std::vector<std::string>& warnings) {
  for (const ReceiverConfig& receiver : run.scenario.receivers) {
    const double mask_rad = receiver.options.fix.elevation_mask_rad;
    const Geodetic place =
        receiver.fixed ? receiver.fixed->place : run.plan.trajectory.at(run.plan.begin).position;
    const std::size_t above = count_above(run, place, 0), left = count_above(run, place, mask_rad);
    constexpr std::size_t kForAFix = 4;
    if (left < kForAFix && above >= kForAFix) {
      warnings.push_back(
          fmt::format("{}: elevation_mask_deg {:.3g} leaves {} of the {} satellites above the horizon at the "
                      "start: no fix",
                      receiver.options.name, geodesy::degrees(mask_rad), left, above));
    }
    if (!(mask_rad > 0 && mask_rad < geodesy::radians(kLeastMask_deg))) continue;
    warnings.push_back(fmt::format(
        "{}: elevation_mask_deg is {:.3g} deg; were radians meant? They would be {:.3g} deg",
        receiver.options.name, geodesy::degrees(mask_rad), geodesy::degrees(geodesy::degrees(mask_rad))));
  }
}

void check_faults(const RunView& run, std::vector<std::string>& warnings) {
  for (const disturbance::Fault& fault : run.scenario.faults) {
    const std::optional<double> own_s = fault.settings->duration_s();
    if (own_s && fault.until_s && std::abs(*fault.until_s - fault.from_s - *own_s) > 1e-6) {
      warnings.push_back(
          fmt::format("fault '{}' ends at {} s only in tables: the receiver takes some {} s, or search_s "
                      "and ephemeris_s",
                      fault.name, *fault.until_s, *own_s));
    }
    if (run.plan.at(run.plan.epochs() - 1) >= run.plan.begin + fault.from_s) {
      check_transmitter(run, fault, warnings);
      continue;
    }
    warnings.push_back(
        fmt::format("fault '{}' begins after {} s, when the run has ended", fault.name, fault.from_s));
  }
}

void check_all_corrections(const Scenario& scenario) {
  for (std::size_t r = 0; r < scenario.receivers.size(); ++r) check_corrections(scenario.receivers, r);
}

}  // namespace

void check_city(const Scenario& scenario, const city::City& city) {
  if (!scenario.city.is<OpenField>() && city.mesh.triangles.empty()) {
    throw scenario_error(scenario, fmt::format("the city '{}' is empty: it has no triangle", city.name),
                         "give another mesh, or city: {open: true} for an open field");
  }
}

std::vector<std::string> check_run(const RunView& run) {
  std::vector<std::string> warnings;
  check_ionosphere(run.scenario, run.sky);
  check_streams(run.scenario);
  check_all_corrections(run.scenario);
  check_all_sensors(run, warnings);
  check_places(run, warnings);
  check_fixed(run, warnings);
  check_masks(run, warnings);
  check_faults(run, warnings);
  return warnings;
}

std::vector<std::string> check_slopes(const RunView& run) {
  const Scenario& scenario = run.scenario;
  const RunPlan& plan = run.plan;
  const bool along =
      std::any_of(scenario.receivers.begin(), scenario.receivers.end(), [](const ReceiverConfig& receiver) {
        const auto& dead_reckoning = receiver.options.dead_reckoning;
        return dead_reckoning.enabled && dead_reckoning.non_holonomic;
      });
  if (!along) return {};
  double most_mps = 0;
  const std::size_t step = std::max<std::size_t>(1, plan.epochs() / 2000);
  for (std::size_t k = 0; k < plan.epochs(); k += step) {
    const Pose pose = vehicle_pose(scenario, plan.trajectory, run.environment, plan.at(k));
    most_mps = std::max(most_mps, std::abs(pose.velocity_enu_mps.dot(pose.up_enu())));
  }
  if (most_mps < 0.2) return {};
  return {
      fmt::format("dead_reckoning: the vehicle moves along its up axis by up to {:.1f} m/s; set "
                  "trajectory.attitude: car, or dead_reckoning: {{non_holonomic: false}} if it flies",
                  most_mps)};
}

std::vector<std::string> placement_warnings(const Scenario& scenario,
                                            std::span<const PlacementCounts> counts) {
  std::vector<std::string> lines;
  for (std::size_t r = 0; r < counts.size(); ++r) {
    const auto say = [&](raytrace::Placement placement, const char* where) {
      const std::size_t n = counts[r][static_cast<std::size_t>(placement)];
      if (n == 0) return;
      lines.push_back(fmt::format("{}: {} {} with the antenna {}: no signal there",
                                  scenario.receivers[r].options.name, n, n == 1 ? "epoch" : "epochs", where));
    };
    say(raytrace::Placement::InsideBuilding, "inside a building");
    say(raytrace::Placement::UnderTerrain, "under the terrain");
  }
  return lines;
}

}  // namespace canyon::simulation
