#include "canyon/simulation/scenario_trajectory.hpp"

#include <fmt/format.h>

#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/simulation/motion/antenna_pose.hpp"

namespace canyon::simulation {

using geodesy::GpsTime;

InputError scenario_error(const Scenario& scenario, std::string_view problem, std::string_view cure) {
  return {scenario.file, 0, problem, cure};
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
                         "add its file, waypoints or position; canyon live also takes --poses FROM");
  }
  if (config.waypoints.size() == 1) {
    if (!scenario.duration_s) {
      throw scenario_error(scenario, "'duration_s' is missing",
                           "give the time that the receiver stays at its position");
    }
    return {Trajectory::fixed(*scenario.start, config.waypoints.front(), *scenario.duration_s), false,
            ReadReport()};
  }
  std::vector<Waypoint> waypoints;
  for (const RecordedPoint& point : path.points)
    waypoints.push_back({point.place, config.speed_mps, config.hold_s});
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
    height_m.reset();  // it is part of the place now
  }
}

}  // namespace canyon::simulation
