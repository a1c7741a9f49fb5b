#include "canyon/sky/orbit/broadcast_sky.hpp"

#include <benchmark/benchmark.h>

#include "canyon/sky/rinex/navigation_reader.hpp"
#include "tests/support/rinex_sample.hpp"

namespace canyon::orbit {
namespace {

gnss::NavigationData sample() {
  return rinex::read_rinex_navigation(TextFile::from_string(test::kRinex3Sample, "sample.rnx"));
}

void propagate_kepler(benchmark::State& bench) {
  const gnss::KeplerEphemeris e = sample().kepler.front();
  geodesy::GpsTime t = e.toe;
  for (auto _ : bench) {
    benchmark::DoNotOptimize(propagate(e, t));
    t = t + std::chrono::milliseconds(1);
  }
}
BENCHMARK(propagate_kepler);

void propagate_glonass(benchmark::State& bench) {
  const gnss::GlonassEphemeris e = sample().glonass.front();
  const geodesy::GpsTime t = e.toe + 850.3;  // close to the usual 15 min
  for (auto _ : bench) benchmark::DoNotOptimize(propagate(e, t));
}
BENCHMARK(propagate_glonass);

void sky_state(benchmark::State& bench) {
  gnss::NavigationData data = sample();
  const gnss::KeplerEphemeris first = data.kepler.front();
  for (int i = 1; i < 100; ++i) {  // a long file
    data.kepler.push_back(first);
    data.kepler.back().toe = first.toe + 3600.0 * i;
  }
  const BroadcastSky sky(std::move(data));
  const geodesy::GpsTime t = first.toe + 50 * 3600.0;
  for (auto _ : bench) benchmark::DoNotOptimize(sky.state(first.id, t));
}
BENCHMARK(sky_state);

}  // namespace
}  // namespace canyon::orbit

BENCHMARK_MAIN();
