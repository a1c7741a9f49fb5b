// Time of one satellite's code lock, and of preparing a tracker.
#include "canyon/receiver/tracking/code_tracking.hpp"

#include <benchmark/benchmark.h>

#include <limits>
#include <vector>

namespace canyon::tracking {
namespace {

CorrelationOptions signal_in(double bandwidth_hz) {
  CorrelationOptions signal;
  signal.bandwidth_hz = bandwidth_hz > 0 ? bandwidth_hz : std::numeric_limits<double>::infinity();
  return signal;
}

DllOptions loop_with(Discriminator discriminator) {
  DllOptions loop;
  loop.discriminator = discriminator;
  loop.spacing_chips = 0.1;
  return loop;
}

/// A direct path and echoes of decreasing strength.
std::vector<SignalPath> street(int count) {
  std::vector<SignalPath> paths{{0, {1, 0}, 0}};
  for (int i = 1; i < count; ++i) {
    paths.push_back({17.0 * i, std::polar(0.6 / i, 2.3 * i), 0.2 * i});
  }
  return paths;
}

/// range(0): paths; range(1): discriminator; range(2): bandwidth [MHz], 0 infinite; range(3): 1 with a prior.
void lock(benchmark::State& state) {
  const CodeTracker tracker(signal_in(1e6 * static_cast<double>(state.range(2))),
                            loop_with(static_cast<Discriminator>(state.range(1))));
  const std::vector<SignalPath> paths = street(static_cast<int>(state.range(0)));
  const std::optional<double> prior =
      state.range(3) != 0 ? std::optional<double>(tracker.lock(paths)->delay_m + 0.3) : std::nullopt;
  for (auto _ : state) benchmark::DoNotOptimize(tracker.lock(paths, prior));
}
BENCHMARK(lock)
    ->ArgNames({"paths", "discriminator", "MHz", "prior"})
    ->Args({2, 1, 0, 1})
    ->Args({2, 1, 8, 1})
    ->Args({10, 1, 8, 1})
    ->Args({10, 2, 8, 1})
    ->Args({10, 3, 8, 1})
    ->Args({10, 1, 8, 0});

/// range(0): bandwidth [MHz].
void prepare(benchmark::State& state) {
  const CorrelationOptions signal = signal_in(1e6 * static_cast<double>(state.range(0)));
  for (auto _ : state)
    benchmark::DoNotOptimize(CodeTracker(signal, loop_with(Discriminator::EarlyLatePower)));
}
BENCHMARK(prepare)->Arg(8)->Arg(24);

}  // namespace
}  // namespace canyon::tracking

BENCHMARK_MAIN();
