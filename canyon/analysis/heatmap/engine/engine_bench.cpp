// Time of a whole map of Hong Kong: 1 m cells at 15 m over 1,226 m x 1,447 m, GPS at one time; the
// synthetic city without the shared data. Threads are the argument. Speed-up: real_time at 1 over that at 2.
#include <benchmark/benchmark.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "canyon/analysis/heatmap/engine/engine.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"
#include "tests/support/bench_city.hpp"

namespace canyon::heatmap {
namespace {

const geodesy::GpsTime kTime = geodesy::GpsTime::from_week(2399, 388'800);  // 2025-12-25 12:00 GPST

const simulation::Environment& environment() {
  static const simulation::Environment environment(
      bench::bench_city().city, std::make_shared<orbit::BroadcastSky>(orbit::nominal_constellation(
                                    kTime, kTime + 86'400.0, {gnss::System::GPS})));
  return environment;
}

Request whole_city(double spacing_m, std::vector<Layer> layers) {
  const city::Box bounds = environment().city().bounds();
  Request request;
  request.grid = Grid::covering(bounds.min.x(), bounds.min.y(), bounds.max.x(), bounds.max.y(), spacing_m);
  request.times = {kTime};
  request.layers = std::move(layers);
  return request;
}

void compute(benchmark::State& state, propagation::Model model, int order, double spacing_m,
             const std::vector<Layer>& layers) {
  simulation::ReceiverConfig receiver;
  receiver.propagation.model = model;
  receiver.propagation.reflection_order = order;
  const Heatmap map(environment(), receiver, whole_city(spacing_m, layers), "");
  tbb::task_arena arena(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    arena.execute([&] {
      tbb::parallel_for(
          tbb::blocked_range<std::size_t>(0, map.unit_count(), 1),
          [&](const tbb::blocked_range<std::size_t>& range) {
            for (std::size_t i = range.begin(); i != range.end(); ++i) {
              benchmark::DoNotOptimize(map.compute(i).values.data());
            }
          },
          tbb::simple_partitioner());
    });
  }
  std::size_t computed = 0;
  for (std::size_t i = 0; i < map.unit_count(); ++i) {
    const std::vector<CellState> unit_state = map.compute(i).state;
    computed +=
        static_cast<std::size_t>(std::count(unit_state.begin(), unit_state.end(), CellState::Computed));
  }
  state.counters["computed"] = static_cast<double>(computed);
  const auto cells = static_cast<double>(map.request().grid.cells());
  state.counters["cells"] = cells;
  state.counters["cells/s"] = benchmark::Counter(cells, benchmark::Counter::kIsIterationInvariantRate);
}

const std::vector<Layer> kLos{Layer::SatellitesLos};
const std::vector<Layer> kGeometry{Layer::SatellitesLos, Layer::SatellitesVisible, Layer::Hdop, Layer::Pdop,
                                   Layer::Vdop};
const std::vector<Layer> kPaper = default_layers();

void bm_line_of_sight(benchmark::State& state) {
  compute(state, propagation::Model::Specular, 0, 1, kLos);
}
/// Only direct signals are received.
void bm_line_of_sight_and_dop(benchmark::State& state) {
  compute(state, propagation::Model::Specular, 0, 1, kGeometry);
}
void bm_mirror_map(benchmark::State& state) {
  compute(state, propagation::Model::Mirror, 1, 1, kPaper);
}
void bm_specular_map(benchmark::State& state) {
  compute(state, propagation::Model::Specular, 1, 1, kPaper);
}
void bm_specular_second_order_map(benchmark::State& state) {
  compute(state, propagation::Model::Specular, 2, 8, kPaper);
}
void bm_sky_view(benchmark::State& state) {
  compute(state, propagation::Model::Specular, 0, 8, {Layer::SkyView});
}

BENCHMARK(bm_line_of_sight)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(bm_line_of_sight_and_dop)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(bm_mirror_map)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(bm_specular_map)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(bm_specular_second_order_map)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(bm_sky_view)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace canyon::heatmap

BENCHMARK_MAIN();
