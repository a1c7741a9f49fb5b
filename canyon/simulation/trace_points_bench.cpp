#include "canyon/simulation/trace_points.hpp"

#include <benchmark/benchmark.h>

#include <cmath>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/receiver_runner.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

// The reference for the time of Python's calls: python/tests/overhead.py makes the same calls.

namespace canyon::simulation {
namespace {

const geodesy::GpsTime kNoon = geodesy::parse_time("2026-06-01T12:00:00Z");

std::shared_ptr<CityScene> downtown() {
  city::SyntheticCityOptions options;
  options.blocks_east = options.blocks_north = 8;
  options.seed = 7;
  return std::make_shared<CityScene>(city::synthetic_city(options));
}

std::vector<Eigen::Vector3d> points(std::size_t count) {
  std::vector<Eigen::Vector3d> all;
  const auto fraction = [](double x) { return x - std::floor(x); };
  for (std::size_t i = 0; i < count; ++i) {
    const auto k = static_cast<double>(i);
    all.emplace_back(456 * fraction(0.6180339887 * k) - 228, 456 * fraction(0.7548776662 * k) - 228, 2);
  }
  return all;
}

void TenThousandPoints(benchmark::State& state) {
  const auto scene = downtown();
  SkyConfig nominal;
  nominal.nominal = true;
  const BuiltSky sky = build_sky(nominal, kNoon, kNoon, scene->city.frame.origin());
  const Environment environment(scene, sky.sky);
  const propagation::Propagator propagator = environment.make_propagator({});
  std::vector<gnss::SatelliteId> satellites;
  for (const gnss::SatelliteId id : sky.sky->satellites()) {
    const auto line = orbit::line_of_sight(*sky.sky, id, kNoon, scene->city.frame.ecef_from_local({0, 0, 2}));
    if (line && line->elevation_rad > 0 && satellites.size() < 30) satellites.push_back(id);
  }
  const std::vector<Eigen::Vector3d> where = points(10'000);
  std::vector<TracedSatellite> result(where.size() * satellites.size());
  const std::vector<geodesy::GpsTime> time{kNoon};
  for (auto _ : state) {
    trace_points(environment, propagator, time, where, satellites, result);
    benchmark::DoNotOptimize(result.data());
  }
  state.counters["satellites"] = static_cast<double>(satellites.size());
}
BENCHMARK(TenThousandPoints)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();

void observe(benchmark::State& state, const std::shared_ptr<CityScene>& scene) {
  ReceiverRunner receiver(parse_live_config("profile: ublox-m10\nown_draws: false\n", "benchmark"), scene,
                          kNoon);
  double t = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        receiver.observe(t, {.position_m = {0, std::fmod(t, 60), 2}, .linear_velocity = {0, 1, 0}}));
    t += 0.1;
  }
}
void ObserveDowntown(benchmark::State& state) {
  observe(state, downtown());
}
BENCHMARK(ObserveDowntown)
    ->Unit(benchmark::kMicrosecond)
    ->Iterations(600)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
/// Steps are short here, so that the overhead of a call is visible.
void ObserveOpenField(benchmark::State& state) {
  city::City city;
  city.frame = downtown()->city.frame;
  observe(state, std::make_shared<CityScene>(std::move(city)));
}
BENCHMARK(ObserveOpenField)
    ->Unit(benchmark::kMicrosecond)
    ->Iterations(600)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

}  // namespace
}  // namespace canyon::simulation

BENCHMARK_MAIN();
