// One epoch of fifty satellites over the sky, averaged over the places of the recorded drive through the Hong
// Kong mesh where the shared data are, else along two streets of the synthetic city. One iteration is one
// epoch.

#include <benchmark/benchmark.h>

#include <cmath>
#include <complex>
#include <cstddef>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/propagation/propagator.hpp"
#include "canyon/signal/path_strength.hpp"
#include "tests/support/bench_scene.hpp"

namespace propagation = canyon::propagation;

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

void epoch(benchmark::State& state, const propagation::PropagationOptions& options) {
  const Fixture& f = fixture();
  const propagation::Propagator propagator(f.city.city.mesh, f.scene, options);
  std::vector<propagation::SatellitePaths> paths(f.sky.size());
  std::size_t place = 0;
  for (auto _ : state) {
    propagator.trace(f.city.places[place], f.sky, paths);
    benchmark::DoNotOptimize(paths.data());
    place = (place + 1) % f.city.places.size();
  }
  std::size_t nlos = 0, reflections = 0;
  for (const Eigen::Vector3d& antenna : f.city.places) {
    propagator.trace(antenna, f.sky, paths);
    for (const propagation::SatellitePaths& p : paths) {
      nlos += p.visibility == propagation::Visibility::NLOS ? 1 : 0;
      for (const auto& path : p.paths)
        reflections += path.kind == canyon::propagation::PathKind::Reflected ? 1 : 0;
    }
  }
  state.counters["reflections_per_epoch"] =
      static_cast<double>(reflections) / static_cast<double>(f.city.places.size());
  state.counters["nlos_per_epoch"] = static_cast<double>(nlos) / static_cast<double>(f.city.places.size());
}

propagation::PropagationOptions with(bool second_order, bool diffraction, bool diffuse) {
  propagation::PropagationOptions options;
  options.reflection_order = second_order ? 2 : 1;
  options.diffraction = diffraction;
  options.diffuse = diffuse;
  return options;
}

/// Everything on, and the amplitudes of all paths at a patch antenna.
void everything(benchmark::State& state, bool amplitudes) {
  const Fixture& f = fixture();
  propagation::PropagationOptions options = with(true, true, true);
  options.ground_reflection = options.through_foliage = true;
  const propagation::Propagator propagator(f.city.city.mesh, f.scene, options);
  const AntennaPattern antenna = canyon::signal::patch_antenna();
  std::vector<propagation::SatellitePaths> paths(f.sky.size());
  std::size_t place = 0, count = 0;
  for (auto _ : state) {
    propagator.trace(f.city.places[place], f.sky, paths);
    std::complex<double> sum = 0;
    for (std::size_t i = 0; i < paths.size(); ++i) {
      count += paths[i].paths.size();
      if (!amplitudes) continue;
      const double elevation = std::asin(f.sky[i].z());
      for (const auto& path : paths[i].paths) sum += path_amplitude(path, elevation, 1575.42e6, antenna);
    }
    benchmark::DoNotOptimize(sum);
    place = (place + 1) % f.city.places.size();
  }
  state.counters["paths_per_epoch"] = static_cast<double>(count) / static_cast<double>(state.iterations());
}

void DirectOnly(benchmark::State& state) {
  propagation::PropagationOptions options;
  options.reflection_order = 0;
  epoch(state, options);
}
BENCHMARK(DirectOnly)->Unit(benchmark::kMicrosecond);

void Mirror(benchmark::State& state) {
  propagation::PropagationOptions options;
  options.model = propagation::Model::Mirror;
  epoch(state, options);
}
BENCHMARK(Mirror)->Unit(benchmark::kMicrosecond);

void SpecularFirstOrder(benchmark::State& state) {
  epoch(state, {});
}
BENCHMARK(SpecularFirstOrder)->Unit(benchmark::kMicrosecond);

void SpecularSecondOrder(benchmark::State& state) {
  propagation::PropagationOptions options;
  options.reflection_order = 2;
  epoch(state, options);
}
BENCHMARK(SpecularSecondOrder)->Unit(benchmark::kMicrosecond);

void SpecularSecondOrderWithGround(benchmark::State& state) {
  propagation::PropagationOptions options;
  options.reflection_order = 2;
  options.ground_reflection = true;
  epoch(state, options);
}
BENCHMARK(SpecularSecondOrderWithGround)->Unit(benchmark::kMicrosecond);

void SpecularWithGround(benchmark::State& state) {
  propagation::PropagationOptions options;
  options.ground_reflection = true;
  epoch(state, options);
}
BENCHMARK(SpecularWithGround)->Unit(benchmark::kMicrosecond);

void SpecularDiffraction(benchmark::State& state) {
  epoch(state, with(false, true, false));
}
BENCHMARK(SpecularDiffraction)->Unit(benchmark::kMicrosecond);

void SpecularDiffuse(benchmark::State& state) {
  epoch(state, with(false, false, true));
}
BENCHMARK(SpecularDiffuse)->Unit(benchmark::kMicrosecond);

void SpecularSecondOrderDiffraction(benchmark::State& state) {
  epoch(state, with(true, true, false));
}
BENCHMARK(SpecularSecondOrderDiffraction)->Unit(benchmark::kMicrosecond);

void SpecularSecondOrderDiffractionDiffuse(benchmark::State& state) {
  epoch(state, with(true, true, true));
}
BENCHMARK(SpecularSecondOrderDiffractionDiffuse)->Unit(benchmark::kMicrosecond);

void Everything(benchmark::State& state) {
  everything(state, false);
}
BENCHMARK(Everything)->Unit(benchmark::kMicrosecond);

void EverythingWithAmplitudes(benchmark::State& state) {
  everything(state, true);
}
BENCHMARK(EverythingWithAmplitudes)->Unit(benchmark::kMicrosecond);

void PrepareFacets(benchmark::State& state) {
  const Fixture& f = fixture();
  for (auto _ : state) benchmark::DoNotOptimize(propagation::Propagator(f.city.city.mesh, f.scene));
}
BENCHMARK(PrepareFacets)->Unit(benchmark::kMillisecond);

void PrepareSecondOrder(benchmark::State& state) {
  const Fixture& f = fixture();
  propagation::PropagationOptions options;
  options.reflection_order = 2;
  for (auto _ : state) benchmark::DoNotOptimize(propagation::Propagator(f.city.city.mesh, f.scene, options));
}
BENCHMARK(PrepareSecondOrder)->Unit(benchmark::kMillisecond);

}  // namespace

int main(int argc, char** argv) {
  return canyon::bench::run_benchmarks(argc, argv, fixture);
}
