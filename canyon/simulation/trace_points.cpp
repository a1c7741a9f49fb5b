#include "canyon/simulation/trace_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/epoch_schedule.hpp"
#include "canyon/simulation/ordered_blocks.hpp"
#include "canyon/simulation/sky_builder.hpp"

namespace canyon::simulation {

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
// Points of one step of work: small enough for threads to end together, large enough for low cost of TBB.
constexpr std::size_t kStep = 16, kBlock = 64;

TracedSatellite traced(const propagation::SatellitePaths& paths, double azimuth_rad, double elevation_rad,
                       raytrace::Containment containment) {
  TracedSatellite satellite;
  satellite.azimuth_rad = azimuth_rad;
  satellite.elevation_rad = elevation_rad;
  satellite.visibility = paths.visibility;
  satellite.excess_m = paths.received() ? paths.tracked_excess_m() : kNan;
  satellite.above_horizon = true;
  satellite.containment = containment;
  satellite.paths = static_cast<std::uint8_t>(std::min<std::size_t>(paths.paths.size(), 255));
  return satellite;
}

void keep(std::vector<TracedPath>& paths, std::size_t index, std::size_t satellite,
          const propagation::SatellitePaths& from) {
  for (const propagation::Path& path : from.paths)
    paths.push_back({static_cast<std::uint32_t>(index), static_cast<std::uint32_t>(satellite), path});
}

/// Calls trace(place, paths) for all points; `paths` is null if they are not requested.
template <typename Trace>
void for_each_point(std::size_t indices, const TracePointsOptions& options, const Trace& trace) {
  using FoundPaths = std::vector<TracedPath>;
  const std::size_t steps = (indices + kStep - 1) / kStep;
  const auto make = [&](std::size_t step) {
    FoundPaths found;
    for (std::size_t i = step * kStep; i < std::min(indices, (step + 1) * kStep); ++i)
      trace(i, options.paths == nullptr ? nullptr : &found);
    return found;
  };
  const auto take = [&](std::size_t step, FoundPaths& found) {
    if (options.paths != nullptr) options.paths->insert(options.paths->end(), found.begin(), found.end());
    if (options.progress) options.progress(std::min(indices, (step + 1) * kStep), indices);
  };
  for_each_in_order<FoundPaths>(
      steps, kBlock, options.threads, [] { return true; }, make, take);
}

void check(std::span<const Eigen::Vector3d> points, std::size_t satellites,
           std::span<TracedSatellite> result) {
  if (result.size() != points.size() * satellites) {
    throw InputError(
        fmt::format("{} results for {} points and {} satellites", result.size(), points.size(), satellites));
  }
  for (std::size_t i = 0; i < points.size(); ++i)
    raytrace::check_position(points[i], fmt::format("point {}", i));
}

}  // namespace

void trace_points(const Environment& environment, const propagation::Propagator& propagator,
                  std::span<const geodesy::GpsTime> times, std::span<const Eigen::Vector3d> points_enu,
                  std::span<const gnss::SatelliteId> satellites, std::span<TracedSatellite> result,
                  const TracePointsOptions& options) {
  check(points_enu, satellites.size(), result);
  if (times.size() != 1 && times.size() != points_enu.size()) {
    throw InputError(fmt::format("{} times for {} points", times.size(), points_enu.size()),
                     "give one time, or one for each point");
  }
  require_satellites(environment.sky(), times);
  std::vector<std::pair<gnss::SatelliteId, std::size_t>> sorted;  // and its index in `satellites`
  for (std::size_t k = 0; k < satellites.size(); ++k) sorted.emplace_back(satellites[k], k);
  std::sort(sorted.begin(), sorted.end());
  std::vector<gnss::SatelliteId> ascending;
  ascending.reserve(sorted.size());
  for (const auto& [id, number] : sorted) ascending.push_back(id);

  const geodesy::LocalFrame& frame = environment.city().frame;
  for_each_point(points_enu.size(), options, [&](std::size_t i, std::vector<TracedPath>* paths) {
    const Eigen::Vector3d& point = points_enu[i];
    propagation::Arrival arrival =
        make_arrival(environment.sky(), ascending, environment.scene(),
                     {times[times.size() == 1 ? 0 : i], frame.ecef_from_local(point), point,
                      frame.ecef_from_local_rotation()});
    add_paths(arrival, tracer_of(propagator));
    const std::span<TracedSatellite> row = result.subspan(i * satellites.size(), satellites.size());
    std::fill(
        row.begin(), row.end(),
        TracedSatellite{kNan, kNan, kNan, propagation::Visibility::Blocked, false, arrival.containment, 0});
    std::size_t k = 0;
    for (const propagation::SatelliteView& view : arrival.views) {  // both ascend
      while (ascending[k] != view.line.id) ++k;
      const std::size_t number = sorted[k++].second;
      row[number] = traced(view.paths, view.line.azimuth_rad, view.line.elevation_rad, arrival.containment);
      if (paths != nullptr) keep(*paths, i, number, view.paths);
    }
  });
}

void trace_points(const Environment& environment, const propagation::Propagator& propagator,
                  std::span<const Eigen::Vector3d> points_enu, std::span<const Eigen::Vector3d> directions,
                  std::span<TracedSatellite> result, const TracePointsOptions& options) {
  check(points_enu, directions.size(), result);
  std::vector<geodesy::AzimuthElevation> looks;
  for (const Eigen::Vector3d& direction : directions) {
    if (!direction.allFinite() || std::abs(direction.norm() - 1) > 1e-6) {
      throw InputError(fmt::format("direction {} is not a unit vector", looks.size()),
                       "give east, north and up of length 1");
    }
    looks.push_back(geodesy::azimuth_elevation_from_enu(direction));
  }
  for_each_point(points_enu.size(), options, [&](std::size_t i, std::vector<TracedPath>* paths) {
    const Eigen::Vector3d& point = points_enu[i];
    const raytrace::Containment containment = environment.scene().containment(point);
    std::vector<propagation::SatellitePaths> found(directions.size());
    if (containment == raytrace::Containment::Free) propagator.trace(point, directions, found);
    for (std::size_t k = 0; k < directions.size(); ++k) {
      TracedSatellite& satellite = result[i * directions.size() + k];
      satellite = traced(found[k], looks[k].azimuth_rad, looks[k].elevation_rad, containment);
      satellite.above_horizon = looks[k].elevation_rad > 0;
      if (paths != nullptr) keep(*paths, i, k, found[k]);
    }
  });
}

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
  const double max_m2 = options.retrace_distance_m * options.retrace_distance_m;
  const bool first = !paths_ || paths_->interval != interval ||
                     !((antenna_enu - paths_->antenna_enu).squaredNorm() <= max_m2);
  if (first) paths_ = std::make_shared<SharedPaths>(SharedPaths{interval, antenna_enu, {}});
  return {time, antenna_enu, paths_, first};
}

Arrival RetracedAntenna::arrival(const Environment& environment, const Epoch& epoch) const {
  propagation::TracedPoint* const traced = epoch.paths ? &epoch.paths->point_index : nullptr;
  return environment.arrival(epoch.time, epoch.antenna_enu,
                             [&](const auto& antenna, const auto& directions, auto paths) {
                               if (epoch.first)
                                 propagator_.trace(antenna, directions, paths, traced);
                               else if (!propagator_.retrace(antenna, directions, *traced, paths))
                                 propagator_.trace(antenna, directions, paths);
                             });
}

}  // namespace canyon::simulation
