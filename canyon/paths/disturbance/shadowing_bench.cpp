// Time of the shadows of one epoch.
#include "canyon/paths/disturbance/shadowing.hpp"
#include "canyon/paths/disturbance/skyline.hpp"

#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"

namespace canyon::disturbance {
namespace {

std::vector<Eigen::Vector3d> sky() {
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < 31; ++i) {
    directions.push_back(
        geodesy::enu_from_azimuth_elevation(2.399963 * i, geodesy::radians(5 + 80 * (i + 0.5) / 31)));
  }
  return directions;
}

/// 31 satellites; distance driven each epoch [m].
void shadows_of_an_epoch(benchmark::State& state) {
  Shadowing shadowing({}, 1, "bench");
  const std::vector<Eigen::Vector3d> directions = sky();
  double travelled_m = 0;
  for (auto _ : state) {
    travelled_m += static_cast<double>(state.range(0));
    shadowing.go_to(travelled_m);
    for (const Eigen::Vector3d& direction : directions)
      benchmark::DoNotOptimize(shadowing.of(direction).level_db);
  }
}
BENCHMARK(shadows_of_an_epoch)->Arg(0)->Arg(1)->Arg(10);

/// The first epoch searches back to the last decision of each satellite's state.
void shadows_of_the_first_epoch(benchmark::State& state) {
  const std::vector<Eigen::Vector3d> directions = sky();
  for (auto _ : state) {
    Shadowing shadowing({}, 1, "bench");
    for (const Eigen::Vector3d& direction : directions)
      benchmark::DoNotOptimize(shadowing.of(direction).level_db);
  }
}
BENCHMARK(shadows_of_the_first_epoch);

/// Obstacles at a position, for this number of paths.
void obstacles_of_an_epoch(benchmark::State& state) {
  ShadowingOptions dense;
  dense.environment = ShadowingEnvironment::Dense;
  Skyline skyline(dense, 1);
  const std::vector<Eigen::Vector3d> directions = sky();
  double travelled_m = 0;
  for (auto _ : state) {
    skyline.go_to({travelled_m += 10, 0}, 2);
    for (std::int64_t i = 0; i < state.range(0); ++i) {
      benchmark::DoNotOptimize(skyline.level_db(directions[static_cast<std::size_t>(i % 31)]));
    }
  }
}
BENCHMARK(obstacles_of_an_epoch)->Arg(0)->Arg(31)->Arg(310);

}  // namespace
}  // namespace canyon::disturbance

BENCHMARK_MAIN();
