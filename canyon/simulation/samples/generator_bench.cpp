// Time to compute samples: satellites of six paths each under an open sky, 4 Msps.
#include "canyon/simulation/samples/generator.hpp"

#include <benchmark/benchmark.h>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/samples/path_interpolator.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::samples {
namespace {

/// Five reflections in addition to each direct path.
class Echoes final : public disturbance::Disturbance {
 public:
  void apply(const propagation::Antenna& /*antenna*/, propagation::Arrival& arrival) override {
    for (propagation::SatelliteView& view : arrival.views) {
      for (std::uint32_t k = 1; k <= 5; ++k) {
        propagation::Path path = view.paths.paths.front();
        path.kind = propagation::PathKind::Reflected;
        path.reflector = k;
        path.excess_m = 30 * k;
        path.incidence_count = 1;
        path.incidences[0].incidence_rad = 1;
        view.paths.paths.push_back(path);
      }
    }
  }
};

class Samples final : public simulation::EpochSink {
 public:
  Samples(const simulation::Simulation& simulation, int threads)
      : generator(simulation.scenario().receivers[0].options, 1, {}, FrontEnd{}, threads) {}
  void write(const simulation::Epoch& epoch) override {
    generator.next(epoch, [this](const SampleBlock& block, std::size_t samples) {
      bytes.resize(2 * samples);
      quantise(block, samples, 32, bytes.data());
      made += samples;
    });
  }
  void finish() override {}
  Generator generator;
  std::vector<std::int8_t> bytes;
  std::size_t made = 0;
};

/// range(0): 1 with Galileo in addition to GPS; range(1): threads.
void four_seconds(benchmark::State& state) {
  simulation::Scenario scenario = simulation::parse_scenario(
      std::string("city: {open: true, origin: {latitude_deg: 48, longitude_deg: 11, height_m: 500}}\n"
                  "sky: {nominal: true, systems: [") +
          (state.range(0) != 0 ? "GPS, Galileo" : "GPS") +
          "]}\nstart: 2026-06-01T08:00:00Z\nrate_hz: 10\nduration_s: 4\n"
          "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 90, north_m: 40, up_m: 2}], "
          "speed_mps: 15}\nreceivers: [{name: rx, signal: {enabled: true}}]\n",
      "bench.yaml");
  scenario.receivers[0].disturbances.push_back(
      {"echoes", [](std::uint64_t, const std::string&) { return std::make_unique<Echoes>(); }});
  city::City city;
  city.frame = geodesy::LocalFrame(*scenario.city.origin);
  const simulation::Simulation simulation(scenario, std::move(city));
  const auto threads = static_cast<int>(state.range(1));
  double paths = 0, samples = 0;
  for (auto _ : state) {
    Samples sink(simulation, threads);
    simulation::RunOptions options;
    options.threads = threads;
    (void)simulation.run({&sink}, options);
    paths = static_cast<double>(sink.generator.contents().max_paths);
    samples = static_cast<double>(sink.made);
  }
  using benchmark::Counter;
  state.counters["paths"] = paths;
  state.counters["real_time"] = Counter(samples / FrontEnd{}.rate_hz, Counter::kIsIterationInvariantRate);
  state.counters["path_samples"] = Counter(samples * paths, Counter::kIsIterationInvariantRate);
}
BENCHMARK(four_seconds)
    ->Args({0, 1})
    ->Args({1, 1})
    ->Args({1, 2})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();

/// A single path: range(0): 1 if its slots are complex.
void path_of_a_millisecond(benchmark::State& state) {
  Slots slots{std::vector<float>(1300, 1), {}};
  if (state.range(0) != 0) slots.im = slots.re;
  SampleBlock block;
  block.clear(4000);
  for (auto _ : state) {
    add_path(slots, {0.3, 0.25575, 0.1, 1e-3, 1e-6}, block);
    benchmark::DoNotOptimize(block.re.data());
  }
  state.SetItemsProcessed(state.iterations() * 4000);
}
BENCHMARK(path_of_a_millisecond)->Arg(0)->Arg(1);

void noise_of_a_millisecond(benchmark::State& state) {
  SampleBlock block;
  block.clear(4000);
  std::uint64_t key = 0;
  for (auto _ : state) {
    add_noise(++key, block);
    benchmark::DoNotOptimize(block.re.data());
  }
  state.SetItemsProcessed(state.iterations() * 4000);
}
BENCHMARK(noise_of_a_millisecond);

}  // namespace
}  // namespace canyon::samples

BENCHMARK_MAIN();
