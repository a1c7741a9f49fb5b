#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/run/environment.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

namespace canyon::simulation {

/// One satellite's signal at one place.
struct TracedSatellite {
  double azimuth_rad = 0;    ///< from north, clockwise; NaN where the satellite is not above the horizon
  double elevation_rad = 0;  ///< likewise
  double excess_m = 0;       ///< SatellitePaths::tracked_excess_m(); NaN where nothing arrives
  propagation::Visibility visibility = propagation::Visibility::Blocked;
  bool above_horizon = false;  ///< and with an ephemeris
  raytrace::Placement placement = raytrace::Placement::Free;
  std::uint8_t paths = 0;  ///< how many arrive; 255 stands for more
};

/// One path among those of trace_places().
struct TracedPath {
  std::uint32_t place = 0, satellite = 0;  ///< indices of the request
  propagation::Path path;
};

struct TracePlacesOptions {
  int threads = 0;  ///< 0: as many as cores; never more than those
  /// Called now and then from the calling thread with places done and in all. An exception of it ends the
  /// work and comes out.
  std::function<void(std::size_t, std::size_t)> progress = {};
  std::vector<TracedPath>* paths = nullptr;  ///< takes all paths, by place, then as `satellites` are given
};

/// Traces satellites at many places: result[i * satellites.size() + k] is satellite k at place i, as
/// Environment::arrival() has it. Same answers on any number of threads.
/// @param times one for all places, or one for each
/// @param places_enu antennas in the city's frame [m], finite
/// Throws InputError for other counts of times or results, a place that is none (raytrace::check_place()),
/// and a time at which no satellite of the sky has an ephemeris.
void trace_places(const Environment& environment, const propagation::Propagator& propagator,
                  std::span<const geodesy::GpsTime> times, std::span<const Eigen::Vector3d> places_enu,
                  std::span<const gnss::SatelliteId> satellites, std::span<TracedSatellite> result,
                  const TracePlacesOptions& options = {});

/// The same of satellites in given directions, at every place the same ones. @param directions unit, ENU
void trace_places(const Environment& environment, const propagation::Propagator& propagator,
                  std::span<const Eigen::Vector3d> places_enu, std::span<const Eigen::Vector3d> directions,
                  std::span<TracedSatellite> result, const TracePlacesOptions& options = {});

/// Number of the interval of time that an instant is in: PropagationOptions::retrace_interval_s > 0, from
/// 1980 on.
[[nodiscard]] std::int64_t retrace_interval(const propagation::PropagationOptions& options,
                                            geodesy::GpsTime time);

/// The paths of one epoch, for the epochs that follow nearby.
struct SharedPaths {
  std::int64_t interval = 0;  ///< retrace_interval()
  Eigen::Vector3d antenna_enu;
  propagation::TracedPlace place;
};

/// Arrivals at an antenna, epoch after epoch: far paths are those of the first epoch in each interval of
/// time, and of each epoch that is too far from the last one with paths of its own
/// (propagation::PropagationOptions::retrace_interval_s).
class RetracedAntenna {
 public:
  explicit RetracedAntenna(propagation::Propagator propagator);

  /// An epoch and the paths that it shares; null where the propagator has no far paths.
  struct Epoch {
    geodesy::GpsTime time;
    Eigen::Vector3d antenna_enu;
    std::shared_ptr<SharedPaths> paths;
    bool first = true;  ///< the paths are found at this epoch
  };
  /// The next epoch. Not thread-safe.
  [[nodiscard]] Epoch next(geodesy::GpsTime time, const Eigen::Vector3d& antenna_enu);
  /// Its arrival. Thread-safe; the epoch that finds the paths comes before those that share them.
  /// @param environment which the propagator belongs to
  [[nodiscard]] propagation::Arrival arrival(const Environment& environment, const Epoch& epoch) const;
  /// Both.
  [[nodiscard]] propagation::Arrival arrival(const Environment& environment, geodesy::GpsTime time,
                                             const Eigen::Vector3d& antenna_enu) {
    return arrival(environment, next(time, antenna_enu));
  }
  /// The next epoch has paths of its own.
  void forget() { paths_.reset(); }

 private:
  propagation::Propagator propagator_;
  bool keeps_paths_;
  std::shared_ptr<SharedPaths> paths_;
};

}  // namespace canyon::simulation
