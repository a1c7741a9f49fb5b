#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "canyon/simulation/epoch_schedule.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/fwd.hpp"

namespace canyon::simulation {

/// The trajectory of a run and its instants.
struct RunPlan {
  Trajectory trajectory;
  geodesy::GpsTime begin;
  EpochSchedule schedule{1};  ///< from `begin`
  std::vector<std::string> warnings;

  [[nodiscard]] std::size_t epochs() const { return static_cast<std::size_t>(schedule.count()); }
  [[nodiscard]] geodesy::GpsTime end() const { return at(epochs() - 1); }
  [[nodiscard]] geodesy::GpsTime at(std::size_t k) const {
    return begin + std::chrono::nanoseconds(schedule.at_ns(static_cast<std::int64_t>(k)));
  }
};

/// Throws InputError where the scenario has no receiver, its start is outside the trajectory, or its epochs
/// are too many. @param geoid_undulation_m see HeightReading
[[nodiscard]] RunPlan make_plan(const Scenario& scenario, double geoid_undulation_m);

}  // namespace canyon::simulation
