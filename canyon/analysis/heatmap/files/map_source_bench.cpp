#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>

#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/analysis/heatmap/files/geotiff_writer.hpp"
#include "canyon/analysis/heatmap/files/netcdf_writer.hpp"
#include "canyon/analysis/heatmap/files/stored_map.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::heatmap {
namespace {

/// A grid of 1 m over the Hong Kong mesh, 1,226 m x 1,447 m, or a multiple of it: three layers of noise as in
/// a map of errors, a third of the cells inside buildings.
struct Map {
  Request request;
  MapSource source;

  explicit Map(std::uint32_t columns, std::uint32_t rows) {
    request.grid.west_m = -0.5 * columns;
    request.grid.south_m = -0.5 * rows;
    request.grid.spacing_m = 1;
    request.grid.columns = columns;
    request.grid.rows = rows;
    request.times = {geodesy::GpsTime::from_week(2051, 46'701)};
    request.layers = {Layer::HorizontalError, Layer::SatellitesVisible, Layer::Hdop};
    source.request = &request;
    source.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(22.3, 114.17, 3));
    source.slice = [this](std::size_t i, std::size_t) {
      const Tile tile = request.grid.tile(i);
      MapSource::Slice slice;
      slice.values.reserve(3 * tile.cells());
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t cell = 0; cell < tile.cells(); ++cell) {
          // SplitMix64's mixing (Steele, Lea and Flood 2014): 24 incompressible bits.
          std::uint64_t noise = (cell * 3 + k + (i << 20U)) * 0x9E3779B97F4A7C15U;
          noise = (noise ^ noise >> 30U) * 0xBF58476D1CE4E5B9U;
          noise = (noise ^ noise >> 27U) * 0x94D049BB133111EBU >> 40U;
          const bool inside = (cell % tile.columns / 24 + cell / tile.columns / 30) % 3 == 0;
          const float value = k == 1 ? static_cast<float>(4 + cell % tile.columns / 32)
                                     : static_cast<float>(noise) * 1e-6F + 1.0F;
          slice.values.push_back(inside ? std::numeric_limits<float>::quiet_NaN() : value);
          if (k == 0) slice.state.push_back(inside ? CellState::InsideBuilding : CellState::Computed);
        }
      }
      return std::optional(std::move(slice));
    };
  }
};

void report(benchmark::State& state, const Map& map, const std::filesystem::path& folder) {
  double bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    bytes += static_cast<double>(entry.file_size());
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  state.counters["MB"] = bytes / 1e6;
  state.counters["peak_MB_of_process"] = static_cast<double>(usage.ru_maxrss) / 1e3;
  state.counters["cells/s"] = benchmark::Counter(
      static_cast<double>(map.request.grid.cells()) * static_cast<double>(state.iterations()),
      benchmark::Counter::kIsRate);
}

void BM_WriteNetcdf(benchmark::State& state) {
  const test::TemporaryFolder folder;
  const Map map(1226 * static_cast<std::uint32_t>(state.range(0)),
                1447 * static_cast<std::uint32_t>(state.range(0)));
  for (auto _ : state) write_netcdf(folder / "map.nc", map.source);
  report(state, map, folder.path());
}
BENCHMARK(BM_WriteNetcdf)->Arg(1)->Arg(4)->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_WriteGeotiffs(benchmark::State& state) {
  const test::TemporaryFolder folder;
  const Map map(1226 * static_cast<std::uint32_t>(state.range(0)),
                1447 * static_cast<std::uint32_t>(state.range(0)));
  for (auto _ : state) (void)write_geotiffs(folder.path(), map.source);
  report(state, map, folder.path());
}
BENCHMARK(BM_WriteGeotiffs)->Arg(1)->Arg(4)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Cells along a route: one after the other, 5 m apart.
void BM_Query(benchmark::State& state) {
  const test::TemporaryFolder folder;
  const Map map(1226, 1447);
  write_netcdf(folder / "map.nc", map.source);
  const StoredMap stored(folder / "map.nc");
  double along = 0;
  for (auto _ : state) {
    along = std::fmod(along + 5, 1200);
    benchmark::DoNotOptimize(stored.at({along - 600, 0.3 * along}, 15, map.request.times[0]));
  }
}
BENCHMARK(BM_Query);

}  // namespace
}  // namespace canyon::heatmap

BENCHMARK_MAIN();
