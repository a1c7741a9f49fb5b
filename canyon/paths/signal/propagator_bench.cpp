// One epoch of fifty satellites over the sky, averaged over the points of the recorded drive through the Hong
// Kong mesh if the shared data exist, else along two streets of the synthetic city. One iteration is one
// epoch.

#include <benchmark/benchmark.h>

#include <cmath>
#include <complex>
#include <cstddef>
#include <utility>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/paths/signal/path_strength.hpp"
#include "tests/support/bench_scene.hpp"

namespace {

using canyon::propagation::Model;
using canyon::propagation::PropagationOptions;
using canyon::propagation::Propagator;
using canyon::propagation::SatellitePaths;
using canyon::propagation::Visibility;
using canyon::signal::AntennaPattern;

using Fixture = canyon::bench::BenchScene;

const Fixture& fixture() {
  static const Fixture fixture;
  return fixture;
}

void epoch(benchmark::State& state, const PropagationOptions& options) {
  const Fixture& f = fixture();
  const Propagator propagator(f.city.city.mesh, f.scene, options);
  std::vector<SatellitePaths> paths(f.sky.size());
  std::size_t index = 0;
  for (auto _ : state) {
    propagator.trace(f.city.positions[index], f.sky, paths);
    benchmark::DoNotOptimize(paths.data());
    index = (index + 1) % f.city.positions.size();
  }
  std::size_t nlos = 0, reflections = 0;
  for (const Eigen::Vector3d& antenna : f.city.positions) {
    propagator.trace(antenna, f.sky, paths);
    for (const SatellitePaths& p : paths) {
      nlos += p.visibility == Visibility::NLOS ? 1 : 0;
      for (const auto& path : p.paths)
        reflections += path.kind == canyon::propagation::PathKind::Reflected ? 1 : 0;
    }
  }
  state.counters["reflections_per_epoch"] =
      static_cast<double>(reflections) / static_cast<double>(f.city.positions.size());
  state.counters["nlos_per_epoch"] = static_cast<double>(nlos) / static_cast<double>(f.city.positions.size());
}

PropagationOptions options_of_order(int order, bool diffraction = false, bool diffuse = false,
                                    bool ground = false) {
  PropagationOptions options;
  options.reflection_order = order;
  options.diffraction = diffraction;
  options.diffuse = diffuse;
  options.ground_reflection = ground;
  return options;
}

/// All options on, and the amplitudes of all paths at a patch antenna.
void everything(benchmark::State& state, bool amplitudes) {
  const Fixture& f = fixture();
  PropagationOptions options = options_of_order(2, true, true, true);
  options.through_foliage = true;
  const Propagator propagator(f.city.city.mesh, f.scene, options);
  const AntennaPattern antenna = canyon::signal::patch_antenna();
  std::vector<SatellitePaths> paths(f.sky.size());
  std::size_t index = 0, count = 0;
  for (auto _ : state) {
    propagator.trace(f.city.positions[index], f.sky, paths);
    std::complex<double> sum = 0;
    for (std::size_t i = 0; i < paths.size(); ++i) {
      count += paths[i].paths.size();
      if (!amplitudes) continue;
      const double elevation = std::asin(f.sky[i].z());
      for (const auto& path : paths[i].paths) sum += path_amplitude(path, elevation, 1575.42e6, antenna);
    }
    benchmark::DoNotOptimize(sum);
    index = (index + 1) % f.city.positions.size();
  }
  state.counters["paths_per_epoch"] = static_cast<double>(count) / static_cast<double>(state.iterations());
}

void prepare(benchmark::State& state, const PropagationOptions& options) {
  const Fixture& f = fixture();
  for (auto _ : state) benchmark::DoNotOptimize(Propagator(f.city.city.mesh, f.scene, options));
}

void register_benchmarks() {
  PropagationOptions mirror;
  mirror.model = Model::Mirror;
  for (const auto& [name, options] :
       {std::pair{"DirectOnly", options_of_order(0)},
        {"Mirror", mirror},
        {"SpecularFirstOrder", options_of_order(1)},
        {"SpecularSecondOrder", options_of_order(2)},
        {"SpecularSecondOrderWithGround", options_of_order(2, false, false, true)},
        {"SpecularWithGround", options_of_order(1, false, false, true)},
        {"SpecularDiffraction", options_of_order(1, true)},
        {"SpecularDiffuse", options_of_order(1, false, true)},
        {"SpecularSecondOrderDiffraction", options_of_order(2, true)},
        {"SpecularSecondOrderDiffractionDiffuse", options_of_order(2, true, true)}}) {
    benchmark::RegisterBenchmark(name, epoch, options)->Unit(benchmark::kMicrosecond);
  }
  benchmark::RegisterBenchmark("Everything", everything, false)->Unit(benchmark::kMicrosecond);
  benchmark::RegisterBenchmark("EverythingWithAmplitudes", everything, true)->Unit(benchmark::kMicrosecond);
  benchmark::RegisterBenchmark("PrepareFacets", prepare, options_of_order(1))->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("PrepareSecondOrder", prepare, options_of_order(2))
      ->Unit(benchmark::kMillisecond);
}

}  // namespace

int main(int argc, char** argv) {
  register_benchmarks();
  return canyon::bench::run_benchmarks(argc, argv, fixture);
}
