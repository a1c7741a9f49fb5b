#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/analysis/heatmap/engine/map_summary.hpp"
#include "canyon/analysis/heatmap/kernels/layers.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

// Metrics of a route on a map, for planners.

namespace canyon::heatmap {

/// StoredMap::at(), or the same of another map.
using MapLookup = std::function<std::optional<MapSample>(const Eigen::Vector2d& enu, double altitude_m,
                                                         geodesy::GpsTime time)>;

struct RouteOptions {
  double step_m = 1;      ///< maximum between stations, (0, 1e6]; half of the map's spacing misses no cell
  double stretch_m = 50;  ///< length of the worst segment, (0, 1e6]
  /// Constant speed on the route, in place of the trajectory's own times; (0, 1e5].
  std::optional<double> speed_mps;
  std::optional<geodesy::GpsTime> start;  ///< empty: the trajectory's
  /// Altitude as the map defines it; empty: the trajectory's height above the ellipsoid.
  std::optional<double> altitude_m;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
/// Visits its fields but `start`.
void visit(options::Visitor& v, RouteOptions& o);

/// The middle of a piece of the route; all pieces have equal length.
struct RouteStation {
  double travelled_m = 0;  ///< from the beginning, in the map's plane
  geodesy::GpsTime time;
  Eigen::Vector2d enu = Eigen::Vector2d::Zero();
  std::optional<MapSample> result;  ///< empty: outside the map or its times
};

struct RouteStretch {
  double from_m = 0, to_m = 0;       ///< along the route
  std::size_t first = 0, count = 0;  ///< stations
};

struct RouteReport {
  double length_m = 0, duration_s = 0;
  std::vector<RouteStation> stations;
  std::size_t known = 0;      ///< stations in computed cells
  std::size_t outside = 0;    ///< of the map or its times
  std::size_t no_answer = 0;  ///< inside buildings, under terrain, outside the map's area
  /// Fraction of the known stations with a fix (fix_fraction()); empty if no layer shows it or none is known.
  std::optional<double> availability;
  /// The map's error that a planner expects: the mean over realizations, else RMS, median, the error without
  /// noise. Index into `layers`; empty if the map has none.
  std::optional<std::size_t> error;
  std::vector<LayerSummary> layers;  ///< in the map's order; of stations that have a value
  /// The segment of stretch_m (the whole route if that is shorter) with the largest mean error; at least half
  /// of its stations have a value.
  std::optional<RouteStretch> worst;
  std::optional<double> worst_error_m;
  /// The longest segment of known stations that mostly have no fix (fraction below one half).
  std::optional<RouteStretch> no_fix;
};

/// Evaluates a map along a trajectory. The path is approximated by chords of at most 0.25 s of the
/// trajectory's time (longer if it lasts over 500,000 s); quantiles are definition 7 of Hyndman and Fan
/// (1996). @param frame of the map @param layers of the map, in the order of its values
/// Throws InputError for options that do not validate() and routes of more than 10 million stations.
[[nodiscard]] RouteReport report_route(const MapLookup& map, const geodesy::LocalFrame& frame,
                                       const std::vector<Layer>& layers,
                                       const simulation::Trajectory& trajectory, const RouteOptions& options);

}  // namespace canyon::heatmap
