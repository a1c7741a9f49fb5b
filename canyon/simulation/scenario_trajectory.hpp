#pragma once

#include <optional>
#include <string_view>

#include "canyon/base/input_error.hpp"
#include "canyon/base/read_report.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/simulation/city_scene.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::simulation {

/// An error that names the scenario's file.
[[nodiscard]] InputError scenario_error(const Scenario& scenario, std::string_view problem,
                                        std::string_view cure);

/// The positions in the file of a scenario's trajectory. Precondition: it has one.
[[nodiscard]] RecordedPath read_path(const Scenario& scenario, const HeightReading& heights);

/// A scenario's trajectory; its waypoints have places. `geoid_undulation_m` is the city's, 0 where it is not
/// known. Throws InputError as readers of files do, and where start or duration_s is needed and absent.
[[nodiscard]] TrajectoryFile make_trajectory(const Scenario& scenario, double geoid_undulation_m);

/// Where a scenario's time begins: its start, else its trajectory file's first instant, whose reading
/// `report` then tells of; empty without either. Throws as make_trajectory().
[[nodiscard]] std::optional<geodesy::GpsTime> first_instant(const Scenario& scenario, ReadReport& report);

/// Gives waypoints that say how high above the terrain they lie their heights. Throws InputError where no
/// terrain lies there.
void put_on_terrain(Scenario& scenario, const CityScene& scene);

}  // namespace canyon::simulation
