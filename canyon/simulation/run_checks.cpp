#include "canyon/simulation/run_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/magnetic_field.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/receiver/rtk/correction_link.hpp"
#include "canyon/simulation/motion/antenna_pose.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/sensor_run.hpp"

namespace canyon::simulation {
namespace {

using geodesy::format_gpst;
using geodesy::Geodetic;
using geodesy::GpsTime;

// A trajectory that is farther from the city has a wrong origin.
constexpr double kFarFromCity_m = 10e3;
// A recorded path that is never lower above the ground is one of an aircraft, or has another height
// reference: undulations of the geoid are significant from there on.
constexpr double kNoVehicle_m = 20;

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
    throw scenario_error(scenario, e.problem(), e.hint());
  }
}

void check_streams(const Scenario& scenario) {
  for (const ReceiverConfig& receiver : scenario.receivers) {
    const std::string& from = receiver.options.corrections.from;
    if (!rtk::is_stream(from)) continue;
    throw scenario_error(
        scenario,
        fmt::format("receiver '{}' uses corrections from '{}', a stream", receiver.options.name, from),
        from.starts_with(rtk::kTopicAddress)
            ? "run it as a node of ROS 2 (docs/ros2.md), or name a base of the scenario"
            : "run it by canyon live, or name a base of the scenario");
  }
}

void check_all_sensors(const RunView& run, std::vector<std::string>& warnings) {
  const Scenario& scenario = run.scenario;
  const auto moves = [](const ReceiverConfig& receiver) { return !receiver.fixed; };
  const bool felt = std::any_of(scenario.receivers.begin(), scenario.receivers.end(), moves);
  if (scenario.outputs.has("highres_imu") && !(felt && scenario.sensors.any())) {
    throw scenario_error(scenario, "outputs.highres_imu has no sensors to write",
                         "add sensors: {imu: {profile: consumer}} and a receiver without a fixed position");
  }
  if (scenario.sensors.magnetometer && !geodesy::magnetic_model_is_valid(run.plan.begin)) {
    warnings.emplace_back(
        "sensors.magnetometer: the World Magnetic Model 2025 is for 2025 to 2030; outside, its errors are "
        "larger: 0.1 uT in 2019, 0.3 uT in 2012");
  }
  for (const ReceiverConfig& receiver : scenario.receivers) {
    try {
      check_sensors(scenario.sensors, receiver);
    } catch (const InputError& e) {
      throw scenario_error(scenario, e.problem(), e.hint());
    }
  }
}

// Along the ground [m].
double distance_to(const Geodetic& origin, Geodetic position) {
  position.height_m = origin.height_m;
  return (geodesy::ecef_from_geodetic(position) - geodesy::ecef_from_geodetic(origin)).norm();
}

InputError far_error(const RunView& run, double distance, const Geodetic& position, GpsTime t) {
  const city::City& city = run.environment.city();
  return scenario_error(
      run.scenario,
      fmt::format(
          "the trajectory is {:.1f} km away from the city '{}' (at latitude {:.6f}, longitude {:.6f}, {})",
          distance / 1e3, city.name, geodesy::degrees(position.latitude_rad),
          geodesy::degrees(position.longitude_rad), format_gpst(t, 0)),
      fmt::format(
          "check city.origin (now latitude {:.6f}, longitude {:.6f}), and that the trajectory's angles "
          "are degrees in the order of its format",
          geodesy::degrees(city.frame.origin().latitude_rad),
          geodesy::degrees(city.frame.origin().longitude_rad)));
}

void check_near(const RunView& run, const city::Box& bounds, const Geodetic& position, GpsTime t) {
  const city::City& city = run.environment.city();
  if (city.mesh.triangles.empty()) return;
  const double distance = distance_to(bounds, city.frame.local_from_geodetic(position));
  if (distance > kFarFromCity_m) throw far_error(run, distance, position, t);
}

// A flight may lead far over an open field, but hardly stays far from it during the whole run. Only the frame
// of local positions depends on the field's origin.
void check_near_field(const RunView& run, std::size_t step, std::vector<std::string>& warnings) {
  if (!run.scenario.city.is<OpenField>() || !run.scenario.city.origin) return;
  const RunPlan& plan = run.plan;
  for (std::size_t k = 0; k < plan.epochs(); k += step)
    if (distance_to(*run.scenario.city.origin, plan.trajectory.at(plan.at(k)).position) <= kFarFromCity_m)
      return;
  const Geodetic geodetic = plan.trajectory.at(plan.begin).position;
  const InputError far =
      far_error(run, distance_to(*run.scenario.city.origin, geodetic), geodetic, plan.begin);
  warnings.push_back(far.problem() + ": " + far.hint());
}

// Checks up to two thousand epochs of the trajectory: speed, height, distance to the city, terrain below.
void check_positions(const RunView& run, std::vector<std::string>& warnings) {
  const RunPlan& plan = run.plan;
  const std::size_t step = std::max<std::size_t>(1, plan.epochs() / 2000);
  const city::Box bounds = run.environment.city().bounds();
  check_near_field(run, step, warnings);
  std::size_t impossible = 0;
  std::string first;
  double lowest_m = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < plan.epochs(); k += step) {
    const Pose pose = plan.trajectory.at(plan.at(k));
    if (const auto why = impossible_motion(pose.position.height_m, pose.velocity_enu_mps); !why.empty()) {
      if (impossible++ == 0) first = fmt::format("the trajectory: {} at {}", why, format_gpst(plan.at(k), 0));
    }
    check_near(run, bounds, pose.position, plan.at(k));
    lowest_m = std::min(lowest_m, run.environment.scene().height_above_ground(
                                      run.environment.city().frame.local_from_geodetic(pose.position)));
    if (run.scenario.trajectory.height_above_terrain_m)
      (void)vehicle_pose(run.scenario, plan.trajectory, run.environment, plan.at(k));
  }
  if (impossible > 1) first += fmt::format(" (the first of {})", impossible);
  if (impossible > 0) warnings.push_back(first);
  const TrajectoryConfig& trajectory = run.scenario.trajectory;
  if (trajectory.file && !trajectory.height_above_terrain_m && !run.scenario.city.is<OpenField>() &&
      lowest_m > kNoVehicle_m) {
    warnings.push_back(fmt::format(
        "the recorded path is never lower than {:.0f} m above the city's ground: if the vehicle drives, its "
        "heights and the city's have different zeros (a map without terrain has its ground at height 0); "
        "trajectory.height_above_terrain_m: 1.5 puts it on the ground",
        lowest_m));
  }
}

// A fixed receiver may be outside the city, under an open sky.
void check_fixed(const RunView& run) {
  for (std::size_t r = 0; r < run.scenario.receivers.size(); ++r) {
    const ReceiverConfig& receiver = run.scenario.receivers[r];
    if (!receiver.fixed) continue;
    const geodesy::LocalFrame& frame = run.environment.city().frame;
    if (is_possible({run.plan.begin, receiver.fixed->position}, frame)) continue;
    const double far_m = frame.local_from_geodetic(receiver.fixed->position).norm();
    throw scenario_error(run.scenario,
                         fmt::format("receivers[{}].fixed: '{}' is {:.0f} km from the city", r,
                                     receiver.options.name, far_m / 1e3),
                         "check its latitude and longitude");
  }
}

// A drive through a building is not intended; a fixed position may be inside, for a test.
void check_waypoints(const RunView& run) {
  const std::vector<Geodetic>& waypoints = run.scenario.trajectory.waypoints;
  const city::City& city = run.environment.city();
  const raytrace::RayScene& scene = run.environment.scene();
  for (std::size_t i = 0; i < waypoints.size() && waypoints.size() > 1; ++i) {
    Pose pose;
    pose.position = waypoints[i];
    if (const auto& height_m = run.scenario.trajectory.height_above_terrain_m)
      (void)clamp_to_terrain(pose, city, scene, *height_m);
    const Eigen::Vector3d at = city.frame.local_from_geodetic(pose.position);
    Eigen::Vector3d free = at;
    for (double away_m = 1, rotation = 0; scene.containment(free) == raytrace::Containment::InsideBuilding;
         rotation += 1 / away_m) {
      if (rotation > 2 * geodesy::kPi) rotation = 0, away_m += 1;
      free = at + away_m * Eigen::Vector3d(std::sin(rotation), std::cos(rotation), 0);
    }
    if (free == at) continue;
    const Geodetic geodetic = city.frame.geodetic_from_local(free);
    throw scenario_error(run.scenario, fmt::format("waypoint {} is inside a building", i + 1),
                         fmt::format("the nearest free position is {{latitude_deg: {:.6f}, longitude_deg: "
                                     "{:.6f}}}, which is {{east_m: {:.1f}, north_m: {:.1f}}}",
                                     geodesy::degrees(geodetic.latitude_rad),
                                     geodesy::degrees(geodetic.longitude_rad), free.x(), free.y()));
  }
}

void check_faults(const RunView& run, std::vector<std::string>& warnings) {
  for (const disturbance::Fault& fault : run.scenario.faults) {
    if (run.plan.at(run.plan.epochs() - 1) >= run.plan.begin + fault.from_s) continue;
    warnings.push_back(
        fmt::format("fault '{}' begins at {} s, after the end of the run", fault.name, fault.from_s));
  }
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
  for (std::size_t r = 0; r < run.scenario.receivers.size(); ++r)
    check_corrections(run.scenario.receivers, r);
  check_all_sensors(run, warnings);
  check_positions(run, warnings);
  check_fixed(run);
  check_waypoints(run);
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
  double max_mps = 0;
  const std::size_t step = std::max<std::size_t>(1, plan.epochs() / 2000);
  for (std::size_t k = 0; k < plan.epochs(); k += step) {
    const Pose pose = vehicle_pose(scenario, plan.trajectory, run.environment, plan.at(k));
    max_mps = std::max(max_mps, std::abs(pose.velocity_enu_mps.dot(pose.up_enu())));
  }
  if (max_mps < 0.2) return {};
  return {
      fmt::format("dead_reckoning: the vehicle moves along its up axis by up to {:.1f} m/s; set "
                  "trajectory.attitude: car, or dead_reckoning: {{non_holonomic: false}} if it flies",
                  max_mps)};
}

std::vector<std::string> containment_warnings(const Scenario& scenario,
                                              std::span<const ContainmentCounts> counts) {
  std::vector<std::string> lines;
  for (std::size_t r = 0; r < counts.size(); ++r) {
    const auto log = [&](raytrace::Containment containment, const char* where) {
      const std::size_t n = counts[r][static_cast<std::size_t>(containment)];
      if (n == 0) return;
      lines.push_back(fmt::format("{}: {} {} with the antenna {}: no signal there",
                                  scenario.receivers[r].options.name, n, n == 1 ? "epoch" : "epochs", where));
    };
    log(raytrace::Containment::InsideBuilding, "inside a building");
    log(raytrace::Containment::UnderTerrain, "under the terrain");
  }
  return lines;
}

}  // namespace canyon::simulation
