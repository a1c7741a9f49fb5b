#include <benchmark/benchmark.h>

#include "canyon/paths/propagation/index/knife_edge.hpp"
#include "canyon/paths/signal/path_strength.hpp"
#include "canyon/paths/signal/radio_materials.hpp"

namespace canyon::signal {
namespace {

propagation::PathGeometry geometry(int reflections, bool edge) {
  propagation::PathGeometry path;
  path.incidence_count = reflections;
  path.incidences[0].incidence_rad = 0.7;
  path.incidences[1].incidence_rad = 1.1;
  path.incidences[1].material = city::Material::Glass;
  path.incidences[1].plane_rotation_rad = 0.3;
  path.excess_m = 20;
  path.arrival_elevation_rad = 0.4;
  if (edge) path.edge_nu = propagation::signed_knife_edge_nu(20, wavelength_m(1575.42e6), true);
  return path;
}

/// One path's amplitude; first argument reflections, second 1 with an edge.
void BM_PathAmplitude(benchmark::State& state) {
  const propagation::PathGeometry path = geometry(static_cast<int>(state.range(0)), state.range(1) != 0);
  const AntennaPattern antenna = patch_antenna();
  for (auto _ : state) benchmark::DoNotOptimize(path_amplitude(path, 0.5, 1575.42e6, antenna));
}
BENCHMARK(BM_PathAmplitude)->Args({0, 0})->Args({1, 0})->Args({2, 0})->Args({0, 1});

/// The slowest argument is just beyond the series' end.
void BM_KnifeEdgeField(benchmark::State& state) {
  const double nu = static_cast<double>(state.range(0)) / 10;
  for (auto _ : state) benchmark::DoNotOptimize(propagation::knife_edge_field(nu));
}
BENCHMARK(BM_KnifeEdgeField)->Arg(5)->Arg(16)->Arg(50);

}  // namespace
}  // namespace canyon::signal

BENCHMARK_MAIN();
