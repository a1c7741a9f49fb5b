#include "canyon/simulation/run_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/rollover.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/scenario_trajectory.hpp"

namespace canyon::simulation {
namespace {

constexpr std::size_t kMaxEpochs = 1'000'000'000;

}  // namespace

using geodesy::format_gpst;
using geodesy::GpsTime;

RunPlan make_plan(const Scenario& scenario, double geoid_undulation_m) {
  if (scenario.receivers.empty())
    throw scenario_error(scenario, "the scenario has no receiver", "give at least one");
  TrajectoryFile file = make_trajectory(scenario, geoid_undulation_m);
  RunPlan plan{file.trajectory.with_attitude(scenario.trajectory.attitude),
               {},
               EpochSchedule(1),
               std::move(file.warnings)};
  const GpsTime first = plan.trajectory.begin();
  const GpsTime last = plan.trajectory.end();
  plan.begin = first;
  if (scenario.start) {
    // A start before a trajectory without dates is the zero of its times.
    if (*scenario.start > last || (*scenario.start < first && file.has_own_dates)) {
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
                           "it is 0 or more");
    }
    if (*scenario.duration_s > duration_s + 1e-9) {
      plan.warnings.push_back(
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

}  // namespace canyon::simulation
