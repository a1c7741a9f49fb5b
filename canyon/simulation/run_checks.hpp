#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/run_plan.hpp"
#include "canyon/simulation/sky_builder.hpp"

namespace canyon::simulation {

/// Throws InputError for a city without a triangle, unless it is an open field.
void check_city(const Scenario& scenario, const city::City& city);

/// A run before its first epoch.
struct RunView {
  const Scenario& scenario;
  const RunPlan& plan;
  const BuiltSky& sky;
  const Environment& environment;
};
/// Checks that the parts of a scenario fit together, and up to two thousand epochs of the trajectory. Returns
/// warnings of probable mistakes. Throws InputError if a run is impossible: corrections without a sender,
/// missing ionosphere coefficients, a trajectory far from the city or next to the terrain, missing sensors.
[[nodiscard]] std::vector<std::string> check_run(const RunView& run);

/// A warning if a vehicle moves along its up axis, as a vehicle does that stays level on a slope: a receiver
/// with dead reckoning treats that as impossible. Call it if the motion is smooth.
[[nodiscard]] std::vector<std::string> check_slopes(const RunView& run);

/// Number of epochs of a receiver by raytrace::Containment.
using ContainmentCounts = std::array<std::size_t, 3>;
/// A warning for each receiver whose antenna was inside a building or under the terrain.
/// @param counts of each receiver of the scenario
[[nodiscard]] std::vector<std::string> containment_warnings(const Scenario& scenario,
                                                            std::span<const ContainmentCounts> counts);

}  // namespace canyon::simulation
