#include "canyon/drawing/views/city_picture.hpp"

#include <benchmark/benchmark.h>

#include "canyon/city/city.hpp"
#include "tests/support/bench_city.hpp"

// A picture of Tsim Sha Tsui where the shared data are, else of the synthetic city, PNG included.

namespace canyon::drawing {
namespace {

void city_view(benchmark::State& state) {
  const bench::BenchCity bench = bench::bench_city();
  CityPictureOptions options;
  options.elevation_deg = static_cast<double>(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(city_png(bench.city, options));
}
BENCHMARK(city_view)
    ->Arg(35)
    ->Arg(90)
    ->ArgName("elevation_deg")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace canyon::drawing

BENCHMARK_MAIN();
