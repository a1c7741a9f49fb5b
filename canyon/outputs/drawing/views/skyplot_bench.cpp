#include "canyon/outputs/drawing/views/skyplot.hpp"

#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <memory>
#include <set>
#include <utility>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"
#include "tests/support/bench_city.hpp"

// A frame of the sky, PNG included, on one thread, at successive points along the drive through Tsim Sha Tsui
// if the shared data exist, else along the synthetic city's streets; nominal satellites of all systems. A
// sheet of 1165 pixels has a disc of 800 x 800.

namespace canyon::drawing {
namespace {

void skyplot(benchmark::State& state) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  bench::BenchCity bench = bench::bench_city();
  const geodesy::GpsTime time = geodesy::parse_time("2026-06-01T08:00:00Z");
  const std::set<gnss::System> systems{gnss::kAllSystems.begin(), gnss::kAllSystems.end()};
  const simulation::Environment environment(
      std::move(bench.city),
      std::make_shared<orbit::BroadcastSky>(orbit::nominal_constellation(time - 7200.0, time, systems)));
  const propagation::Propagator propagator = environment.make_propagator({});
  SkyplotOptions options;
  options.style = state.range(0) == 0 ? SkyStyle::Chart : SkyStyle::Fisheye;
  options.trail_s = 60.0 * static_cast<double>(state.range(1));
  options.sheet.width_px = static_cast<int>(state.range(2));
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(draw_skyplot(environment, propagator, time, bench.positions[i], options));
    i = (i + 37) % bench.positions.size();
  }
}
BENCHMARK(skyplot)
    ->Args({0, 0, 1165})
    ->Args({0, 60, 1165})
    ->Args({1, 0, 1165})
    ->Args({1, 60, 1165})
    ->Args({1, 0, 1980})
    ->ArgNames({"fisheye", "trail_min", "width_px"})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace canyon::drawing

BENCHMARK_MAIN();
