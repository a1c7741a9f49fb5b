// Diffraction at edges compared with the first-order trace, one epoch of fifty satellites: the same points
// and sky as propagator_bench.cpp.

#include <benchmark/benchmark.h>

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/paths/propagation/diffraction.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "tests/support/bench_scene.hpp"

namespace {

using canyon::propagation::DiffractedPath;
using canyon::propagation::DiffractionOptions;
using canyon::propagation::EdgeDiffraction;
using canyon::propagation::Propagator;
using canyon::propagation::SatellitePaths;
using canyon::propagation::Visibility;

struct Fixture : canyon::bench::BenchScene {
  /// Whether each satellite is blocked at each point, by point and then satellite.
  std::unique_ptr<bool[]> blocked = std::make_unique<bool[]>(sky.size() * city.positions.size());

  Fixture() {
    for (std::size_t p = 0; p < city.positions.size(); ++p) {
      for (std::size_t i = 0; i < sky.size(); ++i) {
        blocked[p * sky.size() + i] =
            scene.occluded({city.positions[p], sky[i]}, scene.surface_offset_m(city.positions[p]));
      }
    }
  }
  [[nodiscard]] std::span<const bool> blocked_at(std::size_t index) const {
    return {blocked.get() + index * sky.size(), sky.size()};
  }
};

const Fixture& fixture() {
  static const Fixture fixture;
  return fixture;
}

void SpecularFirstOrder(benchmark::State& state) {
  const Fixture& f = fixture();
  const Propagator propagator(f.city.city.mesh, f.scene);
  std::vector<SatellitePaths> paths(f.sky.size());
  std::size_t index = 0;
  for (auto _ : state) {
    propagator.trace(f.city.positions[index], f.sky, paths);
    benchmark::DoNotOptimize(paths.data());
    index = (index + 1) % f.city.positions.size();
  }
}
BENCHMARK(SpecularFirstOrder)->Unit(benchmark::kMicrosecond);

void diffraction(benchmark::State& state, const DiffractionOptions& options) {
  const Fixture& f = fixture();
  const EdgeDiffraction finder(f.city.city.mesh, f.scene, options);
  std::vector<std::vector<DiffractedPath>> paths(f.sky.size());
  std::size_t index = 0;
  for (auto _ : state) {
    finder.trace(f.city.positions[index], f.sky, f.blocked_at(index), paths);
    benchmark::DoNotOptimize(paths.data());
    index = (index + 1) % f.city.positions.size();
  }
  const Propagator propagator(f.city.city.mesh, f.scene);
  std::vector<SatellitePaths> reflected(f.sky.size());
  double hidden = 0, diffracted = 0, found = 0, near = 0, alone = 0;
  for (std::size_t p = 0; p < f.city.positions.size(); ++p) {
    finder.trace(f.city.positions[p], f.sky, f.blocked_at(p), paths);
    propagator.trace(f.city.positions[p], f.sky, reflected);
    for (std::size_t i = 0; i < f.sky.size(); ++i) {
      const bool any = !paths[i].empty();
      if (f.blocked_at(p)[i]) {
        ++hidden;
        found += static_cast<double>(paths[i].size());
        diffracted += any ? 1 : 0;
        alone += any && reflected[i].visibility == Visibility::Blocked ? 1 : 0;
      } else {
        near += any ? 1 : 0;
      }
    }
  }
  const auto points = static_cast<double>(f.city.positions.size());
  state.counters["edges"] = static_cast<double>(finder.edges().edges().size());
  state.counters["hidden"] = hidden / points;          // satellites of an epoch
  state.counters["diffracted"] = diffracted / points;  // of these, with a path
  state.counters["no_reflection"] = alone / points;    // of these, without a reflection
  state.counters["paths"] = found / points;            // of the hidden ones
  state.counters["weakened"] = near / points;          // clear ones near an edge
}

void Diffraction(benchmark::State& state) {
  diffraction(state, {});
}
BENCHMARK(Diffraction)->Unit(benchmark::kMicrosecond);

void DiffractionTo25Db(benchmark::State& state) {
  DiffractionOptions options;
  options.max_loss_db = 25;
  diffraction(state, options);
}
BENCHMARK(DiffractionTo25Db)->Unit(benchmark::kMicrosecond);

void PrepareEdges(benchmark::State& state) {
  const Fixture& f = fixture();
  for (auto _ : state) benchmark::DoNotOptimize(canyon::propagation::EdgeSet(f.city.city.mesh));
}
BENCHMARK(PrepareEdges)->Unit(benchmark::kMillisecond);

}  // namespace

int main(int argc, char** argv) {
  return canyon::bench::run_benchmarks(argc, argv, fixture);
}
