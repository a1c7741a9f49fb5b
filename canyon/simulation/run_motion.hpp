#pragma once

#include <memory>
#include <string>
#include <vector>

#include "canyon/disturbance/streets.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/run_plan.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

// Where the vehicle and the antennas of a run are.

namespace canyon::simulation {

/// The vehicle's pose at an instant, over the terrain where the scenario gives a height above it. Throws
/// InputError where no terrain is below.
[[nodiscard]] Pose vehicle_pose(const Scenario& scenario, const Trajectory& trajectory,
                                const Environment& environment, geodesy::GpsTime t);

/// Inertial sensors need a motion with a continuous acceleration: recorded positions and the height over a
/// terrain become one, in `plan`, and the scenario's height above the terrain is used up. Returns warnings.
/// Throws InputError for waypoints without an acceleration.
[[nodiscard]] std::vector<std::string> smooth_motion(Scenario& scenario, RunPlan& plan,
                                                     const Environment& environment);

/// The way of a run's whole trajectory over the ground, which does not depend on the epochs that are run.
/// Null without a receiver in streets.
[[nodiscard]] std::shared_ptr<const disturbance::Road> road_of(const Scenario& scenario,
                                                               const Trajectory& trajectory,
                                                               const geodesy::LocalFrame& city);

}  // namespace canyon::simulation
