#include "canyon/outputs/live/session_clock.hpp"

#include <fmt/format.h>

#include <cmath>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/transport/transport.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::live {

using simulation::EpochSchedule;

SessionClock::SessionClock(const simulation::Scenario& scenario, const simulation::LiveOptions& options,
                           const simulation::Simulation* trajectory, bool starts_now)
    : by_stamps_(options.clock == simulation::LiveClock::Stamps),
      speed_(options.speed),
      starts_now_(starts_now && !by_stamps_) {
  if (trajectory != nullptr) {
    start_ = trajectory->begin();
    schedule_ = EpochSchedule(trajectory->interval_s(), static_cast<std::int64_t>(trajectory->epoch_count()));
  } else {
    if (!scenario.start) {
      throw InputError(scenario.file, 0, "'start' is missing",
                       "give the time of the first pose, or leave the trajectory out");
    }
    start_ = *scenario.start;
    const double interval_s = 1 / scenario.rate_hz.value_or(10);
    schedule_ = EpochSchedule(interval_s);
    if (scenario.duration_s) {
      const double count = EpochSchedule::count_within(*scenario.duration_s, interval_s);
      schedule_ = EpochSchedule(interval_s, static_cast<std::int64_t>(count));
    }
  }
  const bool real = std::any_of(options.poses.begin(), options.poses.end(), [](const auto& source) {
    return !source.is_trajectory() && !transport::is_file_address(source.from);
  });
  if (real && by_stamps_ && options.poses.size() > 1) {
    throw InputError(scenario.file, 0, "live.clock is stamps, and there are several sources of poses",
                     "use one source with all vehicles' poses in order, or the wall clock");
  }
  if (real && speed_ != 1) {
    throw InputError(scenario.file, 0, fmt::format("live.speed is {}, but poses arrive in real time", speed_),
                     "remove it; it is for trajectories and logs");
  }
}

std::optional<std::int64_t> SessionClock::begin() {
  wall_begin_ = Wall::now();
  if (!starts_now_) return std::nullopt;
  const auto utc = std::chrono::system_clock::now().time_since_epoch();
  const double ahead_s =
      start_ - geodesy::gps_from_unix(std::chrono::duration_cast<std::chrono::nanoseconds>(utc).count());
  // The scenario's start may have passed while the city was read.
  wall_begin_ += std::chrono::duration_cast<Wall::duration>(std::chrono::duration<double>(ahead_s));
  return static_cast<std::int64_t>(std::ceil(-ahead_s / schedule_.interval_s()));
}

}  // namespace canyon::live
