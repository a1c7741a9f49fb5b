#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/simulation/epoch_schedule.hpp"
#include "canyon/simulation/scenario/live_options.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::live {

/// The time of a session: real time multiplied by LiveOptions::speed, or the stamps of poses. Instants are
/// nanoseconds since the session's start.
class SessionClock {
 public:
  using Wall = std::chrono::steady_clock;

  /// Throws InputError if there is no start, and if the sources of poses do not allow the clock or the speed.
  /// @param trajectory it has the start and the interval; null: the scenario has them
  /// @param starts_now the scenario's start is in real time; stamps ignore it
  SessionClock(const simulation::Scenario& scenario, const simulation::LiveOptions& options,
               const simulation::Simulation* trajectory, bool starts_now);

  [[nodiscard]] geodesy::GpsTime start() const { return start_; }
  /// Of every receiver, without its offset.
  [[nodiscard]] const simulation::EpochSchedule& schedule() const { return schedule_; }
  /// Whether the stamps of poses are the time.
  [[nodiscard]] bool by_stamps() const { return by_stamps_; }

  /// Starts real time. Returns the first epoch that has not passed, if the run starts now.
  [[nodiscard]] std::optional<std::int64_t> begin();
  /// Sets the real time of the run.
  void set(std::int64_t run_ns) {
    if (!by_stamps_) wall_begin_ += Wall::now() - wall_of(run_ns);
  }
  /// The instant of an epoch with a pose.
  void stamp(std::int64_t at_ns) { stamped_ns_ = std::max(stamped_ns_, at_ns); }
  /// The latest stamp(); -1: none.
  [[nodiscard]] std::int64_t stamped_ns() const { return stamped_ns_; }
  /// The run restarts.
  void forget_stamps() { stamped_ns_ = -1; }

  /// By real time.
  [[nodiscard]] std::int64_t now_ns() const {
    const std::int64_t wall_ns = std::chrono::nanoseconds(Wall::now() - wall_begin_).count();
    return speed_ == 1 ? wall_ns : static_cast<std::int64_t>(static_cast<double>(wall_ns) * speed_);
  }
  /// By real time or, with stamps, of the latest epoch.
  [[nodiscard]] geodesy::GpsTime now() const {
    return start_ +
           1e-9 * static_cast<double>(by_stamps_ ? std::max<std::int64_t>(stamped_ns_, 0) : now_ns());
  }
  [[nodiscard]] Wall::time_point wall_of(std::int64_t run_ns) const {
    return wall_begin_ +
           std::chrono::nanoseconds(static_cast<std::int64_t>(static_cast<double>(run_ns) / speed_));
  }

 private:
  bool by_stamps_;
  double speed_;
  bool starts_now_;
  geodesy::GpsTime start_;
  simulation::EpochSchedule schedule_{1};
  Wall::time_point wall_begin_;
  std::int64_t stamped_ns_ = -1;
};

}  // namespace canyon::live
