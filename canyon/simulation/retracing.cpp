#include "canyon/simulation/retracing.hpp"

#include <cmath>
#include <span>

#include "canyon/base/input_error.hpp"
#include "canyon/simulation/epoch_schedule.hpp"

namespace canyon::simulation {
namespace {

using Eigen::Vector3d;
using geodesy::GpsTime;
using propagation::Arrival;
using propagation::Propagator;
using propagation::SatellitePaths;
using propagation::TracedPlace;

bool keeps_paths(const Propagator& propagator) {
  const propagation::PropagationOptions& options = propagator.options();
  return options.retrace_interval_s > 0 && options.retrace_distance_m > 0 && propagator.has_far_paths();
}

Arrival traced(const Environment& environment, GpsTime time, const Vector3d& antenna_enu,
               const Propagator& propagator, TracedPlace& place) {
  return environment.arrival(
      time, antenna_enu,
      [&](const Vector3d& antenna, std::span<const Vector3d> directions, std::span<SatellitePaths> result) {
        propagator.trace(antenna, directions, result, &place);
      });
}

Arrival traced_near(const Environment& environment, GpsTime time, const Vector3d& antenna_enu,
                    const Propagator& propagator, const TracedPlace& place) {
  return environment.arrival(
      time, antenna_enu,
      [&](const Vector3d& antenna, std::span<const Vector3d> directions, std::span<SatellitePaths> result) {
        if (!propagator.retrace(antenna, directions, place, result)) {
          propagator.trace(antenna, directions, result);
        }
      });
}

}  // namespace

std::int64_t retrace_interval(const propagation::PropagationOptions& options, GpsTime time) {
  const std::int64_t length_ns = EpochSchedule(options.retrace_interval_s).interval_ns();
  const std::int64_t now_ns = time.nanoseconds();
  return now_ns / length_ns - (now_ns % length_ns < 0 ? 1 : 0);
}

bool is_near(const propagation::PropagationOptions& options, const Vector3d& place_enu,
             const Vector3d& antenna_enu) {
  return (antenna_enu - place_enu).squaredNorm() <= options.retrace_distance_m * options.retrace_distance_m;
}

Arrival RetracedAntenna::arrival(const Environment& environment, GpsTime time, const Vector3d& antenna_enu) {
  if (!keeps_paths(propagator_)) {
    kept_.reset();
    return environment.arrival(time, antenna_enu, propagator_);
  }
  const propagation::PropagationOptions& options = propagator_.options();
  const std::int64_t interval = retrace_interval(options, time);
  if (kept_ && kept_->interval == interval && is_near(options, kept_->antenna_enu, antenna_enu)) {
    return traced_near(environment, time, antenna_enu, propagator_, kept_->place);
  }
  kept_.emplace(Kept{interval, antenna_enu, {}});
  return traced(environment, time, antenna_enu, propagator_, kept_->place);
}

/// One interval of one receiver.
struct RetracedRun::Interval {
  /// An epoch with paths of its own.
  struct Own {
    std::size_t instant;
    std::once_flag made;
    Arrival arrival;
    TracedPlace place;
  };
  std::size_t first = 0;  ///< instant
  std::once_flag divided;
  std::vector<Own*> of;  ///< [instant - first]: which has its far paths; ends where a place is unknown
  std::vector<std::unique_ptr<Own>> own;
};

RetracedRun::RetracedRun(const Environment& environment, const std::vector<Propagator>& propagators,
                         std::size_t count, Instants instants, Places places)
    : environment_(environment),
      propagators_(propagators),
      count_(count),
      instants_(std::move(instants)),
      places_(std::move(places)) {}
RetracedRun::~RetracedRun() = default;

std::shared_ptr<RetracedRun::Interval> RetracedRun::interval(std::size_t receiver, std::size_t instant) {
  const propagation::PropagationOptions& options = propagators_[receiver].options();
  const std::int64_t number = retrace_interval(options, instants_(instant));
  const auto is_inside = [&](std::size_t other) {
    return retrace_interval(options, instants_(other)) == number;
  };
  std::size_t end = instant + 1;
  while (end < count_ && is_inside(end)) ++end;
  std::shared_ptr<Interval> found;
  {
    const std::lock_guard lock(mutex_);
    std::shared_ptr<Interval>& slot = intervals_[{end, receiver}];
    if (!slot) slot = std::make_shared<Interval>();
    found = slot;
  }
  std::call_once(found->divided, [&] {
    found->first = instant;
    while (found->first > 0 && is_inside(found->first - 1)) --found->first;
    Vector3d last;
    for (std::size_t each = found->first; each < end; ++each) {
      Vector3d antenna;
      try {
        antenna = places_(receiver, each);
      } catch (const InputError&) {
        return;  // it comes out with that epoch
      }
      if (found->own.empty() || !is_near(options, last, antenna)) {
        found->own.push_back(std::make_unique<Interval::Own>());
        found->own.back()->instant = each;
        last = antenna;
      }
      found->of.push_back(found->own.back().get());
    }
  });
  return found;
}

Arrival RetracedRun::arrival(std::size_t receiver, std::size_t instant) {
  const Propagator& propagator = propagators_[receiver];
  const Vector3d antenna = places_(receiver, instant);
  if (!keeps_paths(propagator)) return environment_.arrival(instants_(instant), antenna, propagator);
  const std::shared_ptr<Interval> in = interval(receiver, instant);
  if (instant - in->first >= in->of.size()) {
    return environment_.arrival(instants_(instant), antenna, propagator);
  }
  Interval::Own& own = *in->of[instant - in->first];
  std::call_once(own.made, [&] {
    const Vector3d there = own.instant == instant ? antenna : places_(receiver, own.instant);
    own.arrival = traced(environment_, instants_(own.instant), there, propagator, own.place);
  });
  if (own.instant == instant) return std::move(own.arrival);
  return traced_near(environment_, instants_(instant), antenna, propagator, own.place);
}

void RetracedRun::forget_before(std::size_t instant) {
  const std::lock_guard lock(mutex_);
  intervals_.erase(intervals_.begin(), intervals_.lower_bound({instant + 1, 0}));
}

}  // namespace canyon::simulation
