#include "canyon/simulation/run_plan.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/motion/antenna_pose.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::simulation {

using geodesy::GpsTime;

InputError scenario_error(const Scenario& scenario, std::string_view problem, std::string_view hint) {
  return {scenario.file, 0, problem, hint};
}

RecordedPath read_path(const Scenario& scenario, const HeightReading& heights) {
  const TrajectoryConfig& config = scenario.trajectory;
  return read_recorded_path(*config.file, config.format, scenario.start.value_or(GpsTime{}), heights,
                            config.columns);
}

TrajectoryFile make_trajectory(const Scenario& scenario, double geoid_undulation_m) {
  const TrajectoryConfig& config = scenario.trajectory;
  RecordedPath path;
  if (config.file) {
    path = read_path(scenario, {!config.height_above_terrain_m, geoid_undulation_m});
    if (path.timed) return recorded_trajectory(std::move(path));
  }
  if (!scenario.start) {
    throw scenario_error(scenario, "'start' is missing, and the trajectory has no times",
                         "add start: 2026-01-01T12:00:00Z");
  }
  if (!config.file && config.waypoints.empty()) {
    throw scenario_error(scenario, "'trajectory' is missing",
                         "add its file, waypoints or position; canyon live also accepts --poses FROM");
  }
  if (config.waypoints.size() == 1) {
    if (!scenario.duration_s) {
      throw scenario_error(scenario, "'duration_s' is missing",
                           "give the time for which the receiver is at its position");
    }
    return {Trajectory::fixed(*scenario.start, config.waypoints.front(), *scenario.duration_s), false,
            ReadReport()};
  }
  std::vector<Waypoint> waypoints;
  for (const RecordedPoint& point : path.points)
    waypoints.push_back({point.position, config.speed_mps, config.hold_s});
  for (std::size_t i = 0; i < config.waypoints.size(); ++i) {
    const TrajectoryConfig::Leg leg = config.legs.empty() ? TrajectoryConfig::Leg{} : config.legs.at(i);
    waypoints.push_back(
        {config.waypoints[i], leg.speed_mps.value_or(config.speed_mps), leg.hold_s.value_or(config.hold_s)});
  }
  return {Trajectory::from_waypoints(*scenario.start, waypoints, config.acceleration_mps2), false,
          std::move(path.report)};
}

std::optional<geodesy::GpsTime> first_instant(const Scenario& scenario, ReadReport& report) {
  if (scenario.start || !scenario.trajectory.file) return scenario.start;
  const TrajectoryFile file = make_trajectory(scenario, 0);
  report.append(file.report);
  return file.trajectory.begin();
}

void put_on_terrain(Scenario& scenario, const CityScene& scene) {
  TrajectoryConfig& config = scenario.trajectory;
  for (std::size_t i = 0; i < config.legs.size() && i < config.waypoints.size(); ++i) {
    std::optional<double>& height_m = config.legs[i].height_above_terrain_m;
    if (!height_m) continue;
    Pose pose;
    pose.position = config.waypoints[i];
    if (!clamp_to_terrain(pose, scene.city, scene.scene, *height_m)) {
      throw scenario_error(
          scenario,
          fmt::format("waypoint {}: height_above_terrain_m is given, but there is no terrain", i + 1),
          "use a mesh with terrain there (see city.terrain_names), or give height_m");
    }
    config.waypoints[i] = pose.position;
    height_m.reset();  // included in the position now
  }
}

namespace {

constexpr std::size_t kMaxEpochs = 1'000'000'000;

}  // namespace

using geodesy::format_gpst;

RunPlan make_plan(const Scenario& scenario, double geoid_undulation_m) {
  if (scenario.receivers.empty())
    throw scenario_error(scenario, "the scenario has no receiver", "give at least one");
  TrajectoryFile file = make_trajectory(scenario, geoid_undulation_m);
  RunPlan plan{file.trajectory.with_attitude(scenario.trajectory.attitude),
               {},
               EpochSchedule(1),
               std::move(file.report)};
  const GpsTime first = plan.trajectory.begin();
  const GpsTime last = plan.trajectory.end();
  plan.begin = first;
  if (scenario.start) {
    // If the start is before a trajectory without dates, it is the zero of its times.
    if (*scenario.start > last || (*scenario.start < first && file.is_dated)) {
      throw scenario_error(scenario,
                           fmt::format("the start {} is outside the trajectory ({} to {}){}",
                                       format_gpst(*scenario.start, 3), format_gpst(first, 3),
                                       format_gpst(last, 3), geodesy::rollover_text(first, *scenario.start)),
                           "choose a start within it, or leave it out");
    }
    plan.begin = std::max(*scenario.start, first);
  }
  const double interval_s = scenario.rate_hz ? 1 / *scenario.rate_hz : plan.trajectory.sample_interval_s();
  if (!(interval_s >= 1e-6) || !(interval_s <= 1e6)) {
    throw scenario_error(scenario, fmt::format("an epoch every {} s cannot be simulated", interval_s),
                         "give a rate_hz from 1e-6 to 1e6");
  }
  double duration_s = last - plan.begin;
  if (scenario.duration_s) {
    if (!(*scenario.duration_s >= 0)) {
      throw scenario_error(scenario, fmt::format("duration_s: {} s is out of range", *scenario.duration_s),
                           "give 0 or more");
    }
    if (*scenario.duration_s > duration_s + 1e-9) {
      plan.report.add_line(
          ReadReport::Level::Guess,
          fmt::format("the trajectory ends {} s after the start, before the duration of {} s", duration_s,
                      *scenario.duration_s));
    }
    duration_s = std::min(duration_s, *scenario.duration_s);
  }
  const double epochs = EpochSchedule::count_within(duration_s, interval_s);
  if (epochs > static_cast<double>(kMaxEpochs)) {
    throw scenario_error(scenario, fmt::format("{:.0f} epochs are too many", epochs),
                         fmt::format("lower rate_hz or duration_s: at most {} epochs", kMaxEpochs));
  }
  plan.schedule = EpochSchedule(interval_s, static_cast<std::int64_t>(epochs));
  return plan;
}

Pose vehicle_pose(const Scenario& scenario, const Trajectory& trajectory, const Environment& environment,
                  GpsTime t) {
  Pose pose = trajectory.at(t);
  const std::optional<double>& height_m = scenario.trajectory.height_above_terrain_m;
  if (height_m && !clamp_to_terrain(pose, environment.city(), environment.scene(), *height_m)) {
    throw scenario_error(
        scenario,
        fmt::format("height_above_terrain_m: there is no terrain at latitude {:.6f}, longitude {:.6f} ({})",
                    geodesy::degrees(pose.position.latitude_rad),
                    geodesy::degrees(pose.position.longitude_rad), format_gpst(pose.time, 3)),
        "use a mesh with terrain there (see city.terrain_names), or leave the key out");
  }
  return pose;
}

std::vector<std::string> smooth_motion(Scenario& scenario, RunPlan& plan, const Environment& environment) {
  const auto vehicle = [&](GpsTime t) { return vehicle_pose(scenario, plan.trajectory, environment, t); };
  std::optional<double>& clamped = scenario.trajectory.height_above_terrain_m;
  if (clamped && plan.trajectory.length_m() == 0) {
    plan.trajectory = Trajectory::fixed(plan.trajectory.begin(), vehicle(plan.begin).position,
                                        plan.trajectory.end() - plan.trajectory.begin());
    clamped.reset();
  }
  if (plan.trajectory.smooth() && !clamped) return {};
  const TrajectoryConfig& config = scenario.trajectory;
  if (!config.waypoints.empty() && !config.acceleration_mps2) {
    throw scenario_error(scenario, "sensors: the trajectory changes its speed and direction instantly",
                         "give trajectory.acceleration_mps2, e.g. 2");
  }
  const Trajectory smooth = plan.trajectory.smoothed(vehicle);
  double max_m = 0;
  const std::size_t step = std::max<std::size_t>(1, plan.epochs() / 2000);
  for (std::size_t k = 0; k < plan.epochs(); k += step) {
    const auto at = [&](const Pose& pose) { return geodesy::ecef_from_geodetic(pose.position); };
    max_m = std::max(max_m, (at(smooth.at(plan.at(k))) - at(vehicle(plan.at(k)))).norm());
  }
  const std::string between = config.file ? fmt::format("interpolated between positions {:.3g} s apart and ",
                                                        smooth.sample_interval_s())
                                          : "";
  plan.trajectory = smooth;
  clamped.reset();
  return {fmt::format("sensors: the trajectory is {}smoothed over about a second: shifted by up to {:.2f} m",
                      between, max_m)};
}

std::shared_ptr<const disturbance::Road> road_of(const Scenario& scenario, const Trajectory& trajectory,
                                                 const geodesy::LocalFrame& city) {
  const auto streets_on = [](const ReceiverConfig& receiver) { return receiver.streets.enabled; };
  if (std::none_of(scenario.receivers.begin(), scenario.receivers.end(), streets_on)) return nullptr;
  auto road = std::make_shared<disturbance::Road>();
  const GpsTime first = trajectory.begin();
  constexpr double kStep_s = 0.5;
  const auto steps = static_cast<std::int64_t>(std::ceil((trajectory.end() - first) / kStep_s));
  for (std::int64_t k = 0; k <= steps; ++k) {
    const Pose pose = trajectory.at(first + static_cast<double>(k) * kStep_s);
    road->add(pose.time, city.local_from_geodetic(pose.position).head<2>());
  }
  return road;
}

}  // namespace canyon::simulation
