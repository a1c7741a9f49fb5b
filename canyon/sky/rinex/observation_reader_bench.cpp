#include "canyon/sky/rinex/observation_reader.hpp"

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "tests/support/observation_text.hpp"

namespace canyon::rinex {
namespace {

/// An hour at 1 Hz, 30 satellites of two systems with four observations each.
std::string hour() {
  std::string text = test::observations3();
  for (int s = 0; s < 3600; ++s) {
    text += fmt::format("> 2019 04 28 12 {:02d} {:2d}.0000000  0 30\n", s / 60, s % 60);
    for (int k = 1; k <= 30; ++k) {
      text += fmt::format("{}{:02d}", k % 2 == 0 ? 'G' : 'C', k);
      text += test::field(2e7 + s + k) + test::field(1e8 + 7 * s + k) + test::field(-1234.5 + k) +
              test::field(40);
      text += '\n';
    }
  }
  return text;
}

void read_hour(benchmark::State& state) {
  const std::string text = hour();
  std::size_t observations = 0;
  for (auto _ : state) {
    RinexObservationReader reader(text, "hour.obs");
    while (auto epoch = reader.next()) observations += epoch->signals.size();
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(observations));
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * text.size()));
}
BENCHMARK(read_hour)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace canyon::rinex

BENCHMARK_MAIN();
