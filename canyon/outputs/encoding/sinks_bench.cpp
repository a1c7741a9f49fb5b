// Epochs per second of each output, with the 12 satellites of the sample epoch.
#include <benchmark/benchmark.h>

#include <functional>

#include "canyon/base/options/describe.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "tests/support/sample_epochs.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::encoding {
namespace {

using MakeSink = std::function<std::unique_ptr<simulation::EpochSink>(const std::filesystem::path&)>;

void write_epochs(benchmark::State& state, const MakeSink& make) {
  constexpr int kEpochs = 1000;
  const test::TemporaryFolder folder;
  std::vector<simulation::Epoch> epochs;
  for (int i = 0; i < kEpochs; ++i) {
    epochs.push_back(test::sample_epoch(test::sample_time() + i, test::sample_point(), {1.5, -2.5, 3.5}));
  }
  for (auto _ : state) {
    const auto sink = make(folder / "file");
    for (const auto& epoch : epochs) sink->write(epoch);
    sink->finish();
  }
  state.SetItemsProcessed(state.iterations() * kEpochs);
  state.SetBytesProcessed(state.iterations() *
                          static_cast<std::int64_t>(std::filesystem::file_size(folder / "file")));
}

ReceiverDescription rinex_description() {
  ReceiverDescription header;
  header.systems = {gnss::kAllSystems.begin(), gnss::kAllSystems.end()};
  return header;
}

BENCHMARK_CAPTURE(write_epochs, epochs_csv,
                  [](const auto& path) { return open_file("epochs_csv", path, 0); });
BENCHMARK_CAPTURE(write_epochs, satellites_csv,
                  [](const auto& path) { return open_file("satellites_csv", path, 0); });
BENCHMARK_CAPTURE(write_epochs, nmea, [](const auto& path) { return open_file("nmea", path, 0); });
BENCHMARK_CAPTURE(write_epochs, rinex_observation, [](const auto& path) {
  return open_file("rinex_observation", path, 0, rinex_description());
});
BENCHMARK_CAPTURE(write_epochs, kml, [](const auto& path) { return open_file("kml", path, 0, {"rover"}); });
BENCHMARK_CAPTURE(write_epochs, geojson,
                  [](const auto& path) { return open_file("geojson", path, 0, {"rover"}); });

}  // namespace
}  // namespace canyon::encoding

BENCHMARK_MAIN();
