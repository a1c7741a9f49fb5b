#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/read_report.hpp"
#include "canyon/paths/disturbance/streets.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/epoch_schedule.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/fwd.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::simulation {

/// An error that names the scenario's file.
[[nodiscard]] InputError scenario_error(const Scenario& scenario, std::string_view problem,
                                        std::string_view hint);

/// The positions in the file of a scenario's trajectory. Precondition: it has one.
[[nodiscard]] RecordedPath read_path(const Scenario& scenario, const HeightReading& heights);

/// A scenario's trajectory; its waypoints have positions. `geoid_undulation_m` is the city's, 0 if unknown.
/// Throws InputError as readers of files do, and if start or duration_s is needed and absent.
[[nodiscard]] TrajectoryFile make_trajectory(const Scenario& scenario, double geoid_undulation_m);

/// Start of a scenario's time: its start, else the first instant of its trajectory file, whose reader then
/// adds to `report`; empty without either. Throws as make_trajectory().
[[nodiscard]] std::optional<geodesy::GpsTime> first_instant(const Scenario& scenario, ReadReport& report);

/// Sets the heights of waypoints that are given above the terrain. Throws InputError if there is no terrain.
void put_on_terrain(Scenario& scenario, const CityScene& scene);

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

/// Throws InputError if the scenario has no receiver, its start is outside the trajectory, or it has too many
/// epochs.
/// @param geoid_undulation_m see HeightReading
[[nodiscard]] RunPlan make_plan(const Scenario& scenario, double geoid_undulation_m);

// Positions of the vehicle and the antennas of a run.

/// The vehicle's pose at an instant; over the terrain if the scenario has a height above it. Throws
/// InputError if no terrain is below.
[[nodiscard]] Pose vehicle_pose(const Scenario& scenario, const Trajectory& trajectory,
                                const Environment& environment, geodesy::GpsTime t);

/// Inertial sensors need a motion with a continuous acceleration. Replaces recorded positions and the height
/// over a terrain by such a motion in `plan`; clears the scenario's height above the terrain. Returns
/// warnings. Throws InputError for waypoints without an acceleration.
[[nodiscard]] std::vector<std::string> smooth_motion(Scenario& scenario, RunPlan& plan,
                                                     const Environment& environment);

/// The ground route of a run's whole trajectory, for any computed epochs. Null without a receiver in streets.
[[nodiscard]] std::shared_ptr<const disturbance::Road> road_of(const Scenario& scenario,
                                                               const Trajectory& trajectory,
                                                               const geodesy::LocalFrame& city);

}  // namespace canyon::simulation
