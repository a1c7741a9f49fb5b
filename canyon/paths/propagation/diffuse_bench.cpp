// Diffuse scattering for the satellites of fifty that the city hides, at the points and under the sky of
// propagator_bench.cpp, and its gain in accuracy with more rays.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/paths/propagation/diffuse.hpp"
#include "tests/support/bench_scene.hpp"

namespace {

using canyon::propagation::DiffuseOptions;
using canyon::propagation::DiffusePath;
using canyon::propagation::DiffuseScattering;

struct Fixture : canyon::bench::BenchScene {
  /// Marks the blocked satellites of each point, at most twenty; by point and then satellite.
  std::unique_ptr<bool[]> wanted = std::make_unique<bool[]>(sky.size() * city.positions.size());
  double wanted_per_point = 0;

  Fixture() {
    for (std::size_t p = 0; p < city.positions.size(); ++p) {
      int hidden = 0;
      for (std::size_t i = 0; i < sky.size(); ++i) {
        const bool blocked =
            scene.occluded({city.positions[p], sky[i]}, scene.surface_offset_m(city.positions[p]));
        wanted[p * sky.size() + i] = blocked && ++hidden <= 20;
      }
      wanted_per_point += std::min(hidden, 20) / static_cast<double>(city.positions.size());
    }
  }
  [[nodiscard]] std::span<const bool> wanted_at(std::size_t index) const {
    return {wanted.get() + index * sky.size(), sky.size()};
  }
};

const Fixture& fixture() {
  static const Fixture fixture;
  return fixture;
}

/// One satellite at one point, sum of all classes.
struct Total {
  double power = 0;
  double excess_m = 0;  ///< mean weighted by power
};

/// All wanted satellites at every twentieth point.
std::vector<Total> totals(DiffuseOptions options) {
  options.min_power_db = -100;
  options.max_paths = 64;
  const Fixture& f = fixture();
  const DiffuseScattering scattering(f.city.city.mesh, f.scene, options);
  std::vector<std::vector<DiffusePath>> paths(f.sky.size());
  std::vector<Total> result;
  for (std::size_t p = 0; p < f.city.positions.size(); p += 20) {
    scattering.trace(f.city.positions[p], f.sky, f.wanted_at(p), paths);
    for (std::size_t i = 0; i < f.sky.size(); ++i) {
      if (!f.wanted_at(p)[i]) continue;
      Total& total = result.emplace_back();
      for (const DiffusePath& path : paths[i]) {
        total.power += path.power;
        total.excess_m += path.power * path.excess_m;
      }
      if (total.power > 0) total.excess_m /= total.power;
    }
  }
  return result;
}

void diffuse(benchmark::State& state) {
  const Fixture& f = fixture();
  DiffuseOptions options;
  options.rays = static_cast<int>(state.range(0));
  const DiffuseScattering scattering(f.city.city.mesh, f.scene, options);
  std::vector<std::vector<DiffusePath>> paths(f.sky.size());
  std::size_t index = 0;
  for (auto _ : state) {
    scattering.trace(f.city.positions[index], f.sky, f.wanted_at(index), paths);
    benchmark::DoNotOptimize(paths.data());
    index = (index + 1) % f.city.positions.size();
  }
  double with = 0, found = 0;
  for (std::size_t p = 0; p < f.city.positions.size(); ++p) {
    scattering.trace(f.city.positions[p], f.sky, f.wanted_at(p), paths);
    for (const auto& one : paths) {
      with += one.empty() ? 0 : 1;
      found += static_cast<double>(one.size());
    }
  }
  const auto points = static_cast<double>(f.city.positions.size());
  state.counters["wanted"] = f.wanted_per_point;  // satellites of an epoch
  state.counters["with"] = with / points;         // of these, with a path
  state.counters["paths"] = found / points;

  // Against 4096 rays, of the satellites whose total is above -35 dB with these: quantiles of the error of
  // the total power and of the mean excess.
  options.rays = 4096;
  const std::vector<Total> truth = totals(options);
  options.rays = static_cast<int>(state.range(0));
  const std::vector<Total> these = totals(options);
  double bias_db = 0;
  int missed = 0;
  std::vector<double> db, m;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    if (truth[k].power < std::pow(10, -3.5)) continue;
    if (these[k].power <= 0) {
      ++missed;
      continue;
    }
    const double error_db = 10 * std::log10(these[k].power / truth[k].power);
    bias_db += error_db;
    db.push_back(std::abs(error_db));
    m.push_back(std::abs(these[k].excess_m - truth[k].excess_m));
  }
  std::sort(db.begin(), db.end());
  std::sort(m.begin(), m.end());
  const auto quantile = [](const std::vector<double>& sorted, double q) {
    return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
  };
  state.counters["judged"] = static_cast<double>(db.size());
  state.counters["missed"] = missed;
  state.counters["bias_dB"] = bias_db / static_cast<double>(db.size());
  state.counters["dB_p50"] = quantile(db, 0.5);
  state.counters["dB_p90"] = quantile(db, 0.9);
  state.counters["m_p50"] = quantile(m, 0.5);
  state.counters["m_p90"] = quantile(m, 0.9);
}

BENCHMARK(diffuse)
    ->Arg(48)
    ->Arg(96)
    ->Arg(128)
    ->Arg(160)
    ->Arg(192)
    ->Arg(224)
    ->Arg(256)
    ->Arg(384)
    ->Arg(1024)
    ->Unit(benchmark::kMicrosecond);

}  // namespace

int main(int argc, char** argv) {
  return canyon::bench::run_benchmarks(argc, argv, fixture);
}
