// Time for a street in one epoch of one receiver: 31 satellites, about 50 bodies nearby.
#include "canyon/paths/disturbance/streets.hpp"

#include <benchmark/benchmark.h>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"

namespace canyon::disturbance {
namespace {

const geodesy::GpsTime kStart = geodesy::GpsTime::from_week(2051, 46701);

/// 31 satellites at 5 to 85 degrees, each with a direct path and `more` paths by facades 15 to 40 m away.
propagation::Arrival arrival(int more) {
  propagation::Arrival result;
  result.antenna_enu = {0, 0, 1.8};
  for (int i = 0; i < 31; ++i) {
    const double elevation_rad = geodesy::radians(5 + 80 * (i + 0.5) / 31);
    propagation::SatelliteView view;
    view.line.direction_ecef = geodesy::enu_from_azimuth_elevation(2.399963 * i, elevation_rad);
    propagation::Path path;
    path.arrival = view.line.direction_ecef;
    view.paths.paths.push_back(path);
    for (int k = 0; k < more; ++k) {
      path.kind = k % 2 == 0 ? propagation::PathKind::Reflected : propagation::PathKind::Diffuse;
      path.arrival = geodesy::enu_from_azimuth_elevation(1.7 * k + i, 0.8 * elevation_rad);
      path.point = result.antenna_enu + (15 + 5 * k) * path.arrival;
      path.excess_m = 10 + 5 * k;
      view.paths.paths.push_back(path);
    }
    result.views.push_back(view);
  }
  return result;
}

/// range(0): vehicles per kilometre in each of six lanes; range(1): paths of a satellite in addition to the
/// direct one; range(2): 1 with furniture of an Asian street. Includes copy_of_an_arrival.
void epoch_of_31_satellites(benchmark::State& state) {
  StreetsOptions options;
  options.street.region = StreetRegion::EastAsia;
  options.street.lanes = 3;
  options.street.vehicles_per_km = static_cast<double>(state.range(0));
  if (state.range(2) == 0) {
    options.street.trees_per_km = options.street.signs_per_km = options.street.awnings_per_km =
        options.street.footbridges_per_km = 0;
  }
  auto road = std::make_shared<Road>();
  for (int k = 0; k <= 1000; ++k) road->add(kStart + k, Eigen::Vector2d(10 * k, 20 * std::sin(0.05 * k)));
  options.road = road;
  Streets streets(options, 1);
  const Street street(options.street, 1);
  propagation::Arrival epoch = arrival(static_cast<int>(state.range(1)));
  std::vector<Body> bodies;
  double near = 0, paths = 0;
  const auto drive = [&](int k) {
    const geodesy::GpsTime time = kStart + 0.1 * (k % 10000);
    epoch.antenna_enu.head<2>() = road->at(road->along_m(time)).point;
    propagation::Arrival now = epoch;
    streets.apply({time, {}, {}}, now);
    benchmark::DoNotOptimize(now);
    return now;
  };
  int k = 0;
  for (auto _ : state) (void)drive(k++);
  for (k = 0; k < 1000; ++k) {
    street.near(kStart + 0.1 * (10 * k), road.get(), epoch.antenna_enu, 0, bodies);
    near += static_cast<double>(bodies.size());
    for (const auto& view : drive(10 * k).views) paths += static_cast<double>(view.paths.paths.size());
  }
  state.counters["bodies"] = near / 1000;
  state.counters["paths"] = paths / 1000;
}
BENCHMARK(epoch_of_31_satellites)
    ->ArgNames({"per_km", "more", "furniture"})
    ->Args({25, 0, 0})
    ->Args({25, 5, 0})
    ->Args({65, 5, 0})
    ->Args({65, 5, 1})
    ->Unit(benchmark::kMicrosecond);

void copy_of_an_arrival(benchmark::State& state) {
  const propagation::Arrival epoch = arrival(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    propagation::Arrival now = epoch;
    benchmark::DoNotOptimize(now);
  }
}
BENCHMARK(copy_of_an_arrival)->Arg(0)->Arg(5)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace canyon::disturbance

BENCHMARK_MAIN();
