#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "canyon/gnss/satellite_id.hpp"
#include "canyon/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"

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

}  // namespace canyon::simulation
