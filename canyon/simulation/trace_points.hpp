#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

namespace canyon::simulation {

/// One satellite's signal at one point.
struct TracedSatellite {
  double azimuth_rad = 0;    ///< from north, clockwise; NaN if the satellite is not above the horizon
  double elevation_rad = 0;  ///< likewise
  double excess_m = 0;       ///< SatellitePaths::tracked_excess_m(); NaN if nothing arrives
  propagation::Visibility visibility = propagation::Visibility::Blocked;
  bool above_horizon = false;  ///< and with an ephemeris
  raytrace::Containment containment = raytrace::Containment::Free;
  std::uint8_t paths = 0;  ///< number of arriving paths; 255: at least 255
};

/// One path among those of trace_points().
struct TracedPath {
  std::uint32_t point_index = 0, satellite = 0;  ///< indices of the request
  propagation::Path path;
};

struct TracePointsOptions {
  int threads = 0;  ///< 0: as many as cores, which is the maximum
  /// Called repeatedly on the calling thread with points done and in all. An exception of it is rethrown.
  std::function<void(std::size_t, std::size_t)> progress = {};
  std::vector<TracedPath>* paths = nullptr;  ///< receives all paths, by point, then as in `satellites`
};

/// Traces satellites at many points: result[i * satellites.size() + k] is satellite k at point i, as in
/// Environment::arrival(). The result does not depend on the number of threads.
/// @param times one for all points, or one for each
/// @param points_enu antennas in the city's frame [m], finite
/// Throws InputError for other counts of times or results, an invalid point (raytrace::check_position()), and
/// a time at which no satellite of the sky has an ephemeris.
void trace_points(const Environment& environment, const propagation::Propagator& propagator,
                  std::span<const geodesy::GpsTime> times, std::span<const Eigen::Vector3d> points_enu,
                  std::span<const gnss::SatelliteId> satellites, std::span<TracedSatellite> result,
                  const TracePointsOptions& options = {});

/// The same for satellites in given directions, equal at all points. @param directions unit, ENU
void trace_points(const Environment& environment, const propagation::Propagator& propagator,
                  std::span<const Eigen::Vector3d> points_enu, std::span<const Eigen::Vector3d> directions,
                  std::span<TracedSatellite> result, const TracePointsOptions& options = {});

/// Index of the time interval that contains an instant, counted from 1980 on, with
/// PropagationOptions::retrace_interval_s > 0.
[[nodiscard]] std::int64_t retrace_interval(const propagation::PropagationOptions& options,
                                            geodesy::GpsTime time);

/// The paths of one epoch, for following epochs nearby.
struct SharedPaths {
  std::int64_t interval = 0;  ///< retrace_interval()
  Eigen::Vector3d antenna_enu;
  propagation::TracedPoint point_index;
};

/// Arrivals at an antenna, epoch by epoch. Far paths are traced at the first epoch of each time interval, and
/// at each epoch that is too far from the last traced one
/// (propagation::PropagationOptions::retrace_interval_s); other epochs reuse them.
class RetracedAntenna {
 public:
  explicit RetracedAntenna(propagation::Propagator propagator);

  /// An epoch and the paths that it shares; null if the propagator has no far paths.
  struct Epoch {
    geodesy::GpsTime time;
    Eigen::Vector3d antenna_enu;
    std::shared_ptr<SharedPaths> paths;
    bool first = true;  ///< the paths are traced at this epoch
  };
  /// The next epoch. Not thread-safe.
  [[nodiscard]] Epoch next(geodesy::GpsTime time, const Eigen::Vector3d& antenna_enu);
  /// Its arrival. Thread-safe; the epoch that traces the paths must come before those that share them. @param
  /// environment the propagator's
  [[nodiscard]] propagation::Arrival arrival(const Environment& environment, const Epoch& epoch) const;
  /// next() and its arrival.
  [[nodiscard]] propagation::Arrival arrival(const Environment& environment, geodesy::GpsTime time,
                                             const Eigen::Vector3d& antenna_enu) {
    return arrival(environment, next(time, antenna_enu));
  }
  /// The next epoch traces its own paths.
  void forget() { paths_.reset(); }

 private:
  propagation::Propagator propagator_;
  bool keeps_paths_;
  std::shared_ptr<SharedPaths> paths_;
};

}  // namespace canyon::simulation
