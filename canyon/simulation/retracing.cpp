#include "canyon/simulation/retracing.hpp"

#include <vector>

#include "canyon/simulation/epoch_schedule.hpp"

namespace canyon::simulation {

using Eigen::Vector3d;
using geodesy::GpsTime;
using propagation::Arrival;

std::int64_t retrace_interval(const propagation::PropagationOptions& options, GpsTime time) {
  const std::int64_t length_ns = EpochSchedule(options.retrace_interval_s).interval_ns();
  const std::int64_t now_ns = time.nanoseconds();
  return now_ns / length_ns - (now_ns % length_ns < 0 ? 1 : 0);
}

RetracedAntenna::RetracedAntenna(propagation::Propagator propagator) : propagator_(std::move(propagator)) {
  const propagation::PropagationOptions& options = propagator_.options();
  keeps_paths_ =
      options.retrace_interval_s > 0 && options.retrace_distance_m > 0 && propagator_.has_far_paths();
}

RetracedAntenna::Epoch RetracedAntenna::next(GpsTime time, const Vector3d& antenna_enu) {
  if (!keeps_paths_) return {time, antenna_enu, nullptr};
  const propagation::PropagationOptions& options = propagator_.options();
  const std::int64_t interval = retrace_interval(options, time);
  const double most_m2 = options.retrace_distance_m * options.retrace_distance_m;
  const bool first = !paths_ || paths_->interval != interval ||
                     !((antenna_enu - paths_->antenna_enu).squaredNorm() <= most_m2);
  if (first) paths_ = std::make_shared<SharedPaths>(SharedPaths{interval, antenna_enu, {}});
  return {time, antenna_enu, paths_, first};
}

Arrival RetracedAntenna::arrival(const Environment& environment, const Epoch& epoch) const {
  if (epoch.first) {
    return environment.arrival(epoch.time, epoch.antenna_enu, propagator_,
                               epoch.paths ? &epoch.paths->place : nullptr);
  }
  Arrival arrival = environment.arrival(epoch.time, epoch.antenna_enu);
  if (arrival.placement != raytrace::Placement::Free) return arrival;
  const std::vector<Vector3d> directions = ray_directions(arrival);
  std::vector<propagation::SatellitePaths> paths(directions.size());
  if (!propagator_.retrace(arrival.antenna_enu, directions, epoch.paths->place, paths)) {
    propagator_.trace(arrival.antenna_enu, directions, paths);
  }
  set_paths(arrival, std::move(paths));
  return arrival;
}

}  // namespace canyon::simulation
