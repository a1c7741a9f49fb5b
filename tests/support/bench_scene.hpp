#pragma once

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <Eigen/Core>
#include <vector>

#include "canyon/city/raytrace/ray_scene.hpp"
#include "tests/support/bench_city.hpp"

namespace canyon::bench {

/// A city and its rays under fifty satellites.
struct BenchScene {
  BenchCity city = bench_city();
  std::vector<Eigen::Vector3d> sky = spread_sky(50);
  raytrace::RayScene scene{city.city.mesh};
};

/// main() of benchmarks over a scene, printing its description first. @param scene returns the scene
template <typename Scene>
int run_benchmarks(int argc, char** argv, const Scene& scene) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  const BenchScene& over = scene();
  fmt::print("{}, {} triangles, {} places, {} satellites\n", over.city.city.name,
             over.city.city.mesh.triangles.size(), over.city.positions.size(), over.sky.size());
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace canyon::bench
