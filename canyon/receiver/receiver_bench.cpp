// Time of one epoch of a receiver, with and without signal strength; and of one channel.
#include "canyon/receiver/receiver.hpp"

#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/receiver/tracking/channel.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::receiver {
namespace {

using propagation::Path;
using propagation::PathKind;
using propagation::SatelliteView;
using propagation::Visibility;

const geodesy::Geodetic kPosition = geodesy::Geodetic::from_degrees(22.3, 114.18, 30);
const geodesy::GpsTime kTime = geodesy::GpsTime::from_week(2100, 43'200);

/// 50 satellites spread over the sky, at elevations of 5 to 85 degrees.
const orbit::FrozenSky& sky() {
  static const orbit::FrozenSky result = [] {
    std::vector<double> azimuths, elevations;
    for (int i = 0; i < 50; ++i) {
      azimuths.push_back(2.399963 * i);  // the golden angle
      elevations.push_back(geodesy::radians(5 + 80 * (i + 0.5) / 50));
    }
    return orbit::FrozenSky(kPosition, azimuths, elevations);
  }();
  return result;
}

/// A path of concrete `i`: alternating reflections, edges and clusters, at detours of 3 to 130 m.
Path path_of(int i, double elevation_rad, double excess_m) {
  Path path;
  path.kind = i % 5 == 4 ? PathKind::Diffracted : i % 5 == 3 ? PathKind::Diffuse : PathKind::Reflected;
  path.excess_m = excess_m;
  path.reflector = static_cast<std::uint64_t>(100 + i);
  path.arrival = geodesy::enu_from_azimuth_elevation(1.7 * i, elevation_rad);
  path.scattered_power = 1e-3;
  path.arrival_elevation_rad = elevation_rad;
  if (path.kind == PathKind::Diffracted) path.edge_nu = 1 + 0.1 * i;
  if (path.kind == PathKind::Reflected) {
    path.order = 1;
    path.incidence_count = 1;
    path.incidences[0] = {0.1 * (i + 1), city::Material::Concrete, {}, 0};
  }
  return path;
}

/// Views of epoch `k`, a second after the previous one: detours change with a drive of 10 m/s.
std::vector<SatelliteView> street(int paths, int k) {
  std::vector<SatelliteView> views;
  for (const gnss::SatelliteId id : sky().satellites()) {
    SatelliteView view;
    view.line = *orbit::line_of_sight(sky(), id, kTime + 1.0 * k, geodesy::ecef_from_geodetic(kPosition));
    const bool direct = id.number % 2 == 0;
    if (direct) {
      Path path;
      path.arrival = geodesy::enu_from_azimuth_elevation(view.line.azimuth_rad, view.line.elevation_rad);
      path.arrival_elevation_rad = view.line.elevation_rad;
      view.paths.paths.push_back(path);
    }
    for (int i = direct ? 1 : 0; i < paths; ++i) {
      view.paths.paths.push_back(path_of(i, view.line.elevation_rad, 3 + 13.0 * i + 0.7 * (k % 10)));
    }
    view.paths.visibility = direct ? Visibility::LOSMultipath : Visibility::NLOS;
    views.push_back(view);
  }
  return views;
}

/// range(0): paths of each satellite; range(1): 1 with strength. Includes the fix of every epoch: minus
/// solve_fix_of_satellites/50 it is the part of the signals.
void epoch_of_50_satellites(benchmark::State& state) {
  ReceiverOptions options;
  options.signal.enabled = state.range(1) != 0;
  options.signal.front_end_bandwidth_hz = 8e6;
  options.signal.lock.warm_start = true;
  // No satellite is above it: the fix has no work, but all channels do.
  if (state.range(2) == 0) options.fix.elevation_mask_rad = geodesy::radians(89);
  Receiver receiver(options, 1);
  const Eigen::Matrix3d ecef_from_enu = geodesy::LocalFrame(kPosition).ecef_from_local_rotation();
  std::vector<propagation::Arrival> drive;
  for (int k = 0; k < 10; ++k) {
    drive.push_back(
        {raytrace::Containment::Free, street(static_cast<int>(state.range(0)), k), ecef_from_enu});
  }
  const Eigen::Vector3d start = geodesy::ecef_from_geodetic(kPosition);
  const Eigen::Vector3d velocity = ecef_from_enu * Eigen::Vector3d(8, 6, 0);
  std::int64_t k = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(receiver.observe(
        {{kTime + static_cast<double>(k), start + static_cast<double>(k % 10) * velocity, velocity},
         drive[static_cast<std::size_t>(k % 10)],
         sky(),
         {}}));
    ++k;
  }
}
BENCHMARK(epoch_of_50_satellites)
    ->ArgNames({"paths", "strength", "fix"})
    ->Args({10, 0, 0})
    ->Args({1, 1, 0})
    ->Args({4, 1, 0})
    ->Args({10, 1, 0})
    ->Args({10, 0, 1})
    ->Args({10, 1, 1})
    ->Unit(benchmark::kMicrosecond);

/// Only the amplitudes of ten paths.
void amplitudes_of_ten_paths(benchmark::State& state) {
  const std::vector<SatelliteView> views = street(10, 0);
  const tracking::SignalOptions options;
  for (auto _ : state) {
    for (const Path& path : views[21].paths.paths) {
      benchmark::DoNotOptimize(signal::path_amplitude(path, views[21].line.elevation_rad, 1575.42e6,
                                                      options.antenna, options.strength));
    }
  }
}
BENCHMARK(amplitudes_of_ten_paths);

}  // namespace
}  // namespace canyon::receiver

BENCHMARK_MAIN();
