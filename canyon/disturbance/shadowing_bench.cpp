// Time of the shadows of one epoch.
#include "canyon/disturbance/shadowing.hpp"

#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/frames.hpp"

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

ShadowingOptions options(bool blockages) {
  ShadowingOptions result;
  if (blockages) result.blockage.share = 0.2;
  return result;
}

/// 31 satellites; driven each epoch [m], with blockages or without.
void shadows_of_an_epoch(benchmark::State& state) {
  Shadowing shadowing(options(state.range(1) != 0), 1, "bench");
  const std::vector<Eigen::Vector3d> directions = sky();
  double way_m = 0;
  for (auto _ : state) {
    way_m += static_cast<double>(state.range(0));
    shadowing.go_to(way_m);
    for (const Eigen::Vector3d& direction : directions)
      benchmark::DoNotOptimize(shadowing.of(direction).level_db);
  }
}
BENCHMARK(shadows_of_an_epoch)->ArgsProduct({{0, 1, 10}, {0, 1}});

/// The first epoch goes back to where each satellite's state was decided.
void shadows_of_the_first_epoch(benchmark::State& state) {
  const std::vector<Eigen::Vector3d> directions = sky();
  for (auto _ : state) {
    Shadowing shadowing(options(true), 1, "bench");
    for (const Eigen::Vector3d& direction : directions)
      benchmark::DoNotOptimize(shadowing.of(direction).level_db);
  }
}
BENCHMARK(shadows_of_the_first_epoch);

/// Blockages of 31 paths that are not direct.
void blockages_of_paths(benchmark::State& state) {
  Shadowing shadowing(options(true), 1, "bench");
  const std::vector<Eigen::Vector3d> directions = sky();
  for (auto _ : state) {
    for (const Eigen::Vector3d& direction : directions)
      benchmark::DoNotOptimize(shadowing.path_level_db(direction));
  }
}
BENCHMARK(blockages_of_paths);

}  // namespace
}  // namespace canyon::disturbance

BENCHMARK_MAIN();
