#include "canyon/simulation/run_motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/simulation/motion/antenna_pose.hpp"
#include "canyon/simulation/scenario_trajectory.hpp"

namespace canyon::simulation {

using geodesy::GpsTime;

Pose vehicle_pose(const Scenario& scenario, const Trajectory& trajectory, const Environment& environment,
                  GpsTime t) {
  Pose pose = trajectory.at(t);
  const std::optional<double>& height_m = scenario.trajectory.height_above_terrain_m;
  if (height_m && !clamp_to_terrain(pose, environment.city(), environment.scene(), *height_m)) {
    throw scenario_error(
        scenario,
        fmt::format("height_above_terrain_m: no terrain is at latitude {:.6f}, longitude {:.6f} ({})",
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
    throw scenario_error(scenario, "sensors: the trajectory changes its speed and direction at once",
                         "give trajectory.acceleration_mps2, e.g. 2");
  }
  const Trajectory smooth = plan.trajectory.smoothed(vehicle);
  double most_m = 0;
  const std::size_t step = std::max<std::size_t>(1, plan.epochs() / 2000);
  for (std::size_t k = 0; k < plan.epochs(); k += step) {
    const auto at = [&](const Pose& pose) { return geodesy::ecef_from_geodetic(pose.position); };
    most_m = std::max(most_m, (at(smooth.at(plan.at(k))) - at(vehicle(plan.at(k)))).norm());
  }
  const std::string between = config.file ? fmt::format("interpolated between positions {:.3g} s apart and ",
                                                        smooth.sample_interval_s())
                                          : "";
  plan.trajectory = smooth;
  clamped.reset();
  return {fmt::format("sensors: the trajectory is {}smoothed over about a second; it moves by up to {:.2f} m",
                      between, most_m)};
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
