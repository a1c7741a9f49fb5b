#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "canyon/disturbance/streets.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/epoch_schedule.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/fwd.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::simulation {

/// The trajectory of a run and its instants.
struct RunPlan {
  Trajectory trajectory;
  geodesy::GpsTime begin;
  EpochSchedule schedule{1};  ///< from `begin`
  ReadReport report;          ///< of the trajectory

  [[nodiscard]] std::size_t epochs() const { return static_cast<std::size_t>(schedule.count()); }
  [[nodiscard]] geodesy::GpsTime end() const { return at(epochs() - 1); }
  [[nodiscard]] geodesy::GpsTime at(std::size_t k) const {
    return begin + std::chrono::nanoseconds(schedule.at_ns(static_cast<std::int64_t>(k)));
  }
};

/// Throws InputError where the scenario has no receiver, its start is outside the trajectory, or its epochs
/// are too many. @param geoid_undulation_m see HeightReading
[[nodiscard]] RunPlan make_plan(const Scenario& scenario, double geoid_undulation_m);

// Where the vehicle and the antennas of a run are.

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
