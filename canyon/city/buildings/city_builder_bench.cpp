// Imports a synthetic extract of 100,000 buildings as a user would: .osm file to mesh, on one core. The goal
// is below 60 s and 2 GB. Reports total seconds, seconds per 1,000 buildings, and the program's peak memory.
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "canyon/base/random.hpp"
#include "canyon/city/buildings/city_builder.hpp"
#include "canyon/city/buildings/sources/osm_reader.hpp"

namespace canyon::buildings {
namespace {

constexpr int kBuildings = 100'000;

/// The same numbers everywhere.
class Random {
 public:
  double uniform() { return static_cast<double>(mix64(state_ += kGolden64) >> 11U) * 0x1p-53; }

 private:
  std::uint64_t state_ = 1;
};

/// A grid of L-shaped blocks 30 m apart; every tenth is an outline with two parts, every fifth has a shaped
/// roof; heights are tagged, from levels or missing in rotation. Sorted like real extracts: nodes, ways.
void write_extract(const std::filesystem::path& path) {
  Random random;
  std::ofstream out(path);
  out << "<?xml version='1.0' encoding='UTF-8'?>\n<osm version='0.6'>\n";
  std::string routes;
  std::int64_t node = 0, route = 0;
  const double lat_per_m = 1 / 111'200.0, lon_per_m = 1 / 74'500.0;  // about latitude 48
  const auto add = [&](const std::vector<std::array<double, 2>>& ring, const std::string& tags) {
    routes += fmt::format("<way id='{}' version='1'>", ++route);
    const std::int64_t first = node + 1;
    for (const auto& [east, north] : ring) {
      out << fmt::format("<node id='{}' version='1' lat='{:.7f}' lon='{:.7f}'/>\n", ++node,
                         48 + north * lat_per_m, 11 + east * lon_per_m);
      routes += fmt::format("<nd ref='{}'/>", node);
    }
    routes += fmt::format("<nd ref='{}'/>{}</way>\n", first, tags);
  };
  const auto tag = [](const char* key, const std::string& value) {
    return fmt::format("<tag k='{}' v='{}'/>", key, value);
  };
  static constexpr std::array<const char*, 4> kRoofs{"gabled", "hipped", "pyramidal", "mansard"};
  const int columns = 317;
  for (int i = 0; i < kBuildings; ++i) {
    const double x = 30.0 * (i % columns) + 2 * random.uniform(), y = 30.0 * (i / columns);
    const double w = 10 + 10 * random.uniform(), d = 10 + 8 * random.uniform();
    const double height = 4 + 30 * random.uniform();
    std::string tags = tag("building", "yes");
    if (i % 3 == 0) tags += tag("height", fmt::format("{:.1f}", height));
    if (i % 3 == 1) tags += tag("building:levels", fmt::format("{}", static_cast<int>(height / 3) + 1));
    if (i % 5 == 0) {
      tags += tag("roof:shape", kRoofs[static_cast<std::size_t>(i / 5) % kRoofs.size()]);
      add({{x, y}, {x + w, y}, {x + w, y + d}, {x, y + d}}, tags);
    } else {
      add({{x, y}, {x + w, y}, {x + w, y + d / 2}, {x + w / 2, y + d / 2}, {x + w / 2, y + d}, {x, y + d}},
          tags);
    }
    if (i % 10 == 3) {
      const std::string part = tag("building:part", "yes");
      add({{x, y}, {x + w, y}, {x + w, y + d / 2}, {x, y + d / 2}}, part + tag("height", "20"));
      add({{x, y + d / 2}, {x + w / 2, y + d / 2}, {x + w / 2, y + d}, {x, y + d}},
          part + tag("height", "12"));
    }
  }
  out << routes << "</osm>\n";
}

void import_hundred_thousand(benchmark::State& state) {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / fmt::format("canyon-bench-{}.osm", getpid());
  write_extract(path);
  for (auto _ : state) {
    const BuiltCity built = build_city(read_osm({path}), nullptr, {});
    benchmark::DoNotOptimize(built.city.mesh.triangles.data());
    state.counters["buildings"] =
        static_cast<double>(built.report.buildings + built.report.outlines_replaced);
    state.counters["triangles"] = static_cast<double>(built.city.mesh.triangles.size());
  }
  std::filesystem::remove(path);
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  state.counters["peak_MB"] = static_cast<double>(usage.ru_maxrss) / 1024;
  state.counters["s_per_1000"] = benchmark::Counter(
      kBuildings / 1000.0, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(import_hundred_thousand)->Unit(benchmark::kSecond)->Iterations(1);

}  // namespace
}  // namespace canyon::buildings

BENCHMARK_MAIN();
