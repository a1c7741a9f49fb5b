// Shadows of a whole city compared with a bare Embree loop over the same rays, in one program.
//
// The rays are those of a map: from every cell of a 1 m grid over the city at 15 m (in tiles of 256 x 256) to
// twelve satellites, in the Hong Kong mesh if the shared data are available, else in the synthetic city.
// After the benchmarks the program runs all methods alternately, tile by tile, and prints the median ratios
// of the rates, which depend less on the machine than rates. It uses CPU time of the thread, so that other
// programs on the machine do not count.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <ctime>
#include <functional>
#include <limits>
#include <memory>
#include <numeric>
#include <thread>
#include <vector>

#include "canyon/analysis/heatmap/kernels/shadows.hpp"
#include "canyon/city/raytrace/embree.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "tests/support/bare_embree.hpp"
#include "tests/support/bench_city.hpp"
#include "tests/support/shadow_reference.hpp"

namespace {

using canyon::city::Mesh;
using canyon::heatmap::CellPlane;
using canyon::heatmap::ShadowCaster;
using canyon::raytrace::Ray;
using canyon::raytrace::RayScene;
using Eigen::Vector3d;

constexpr std::uint32_t kTile = 256;
constexpr std::uint32_t kMaxCells = kTile * kTile;
constexpr double kMirrorRange_m = 100;
constexpr int kRounds = 5;

/// The loop of a typical program with Embree alone: a robust scene and floats prepared beforehand.
class BareEmbree {
 public:
  explicit BareEmbree(const Mesh& mesh) : bare_(mesh) {
    single_.resize(kMaxCells);
    packets8_.resize(kMaxCells / 8);
    packets16_.resize(kMaxCells / 16);
  }

  /// Rays of a tile, in all forms.
  void prepare(const CellPlane& plane, const Vector3d& direction) {
    count_ = std::size_t{plane.columns} * plane.rows;
    RTCRay r{};
    r.org_z = static_cast<float>(plane.z);
    r.dir_x = static_cast<float>(direction.x());
    r.dir_y = static_cast<float>(direction.y());
    r.dir_z = static_cast<float>(direction.z());
    r.tfar = std::numeric_limits<float>::infinity();
    r.mask = 0xFFFFFFFFu;
    for (std::uint32_t i = 0; i < kMaxCells; ++i) {
      if (i < count_) {
        const Vector3d at =
            canyon::heatmap::reference::cell_point(plane, i % plane.columns, i / plane.columns);
        r.org_x = static_cast<float>(at.x());
        r.org_y = static_cast<float>(at.y());
      }
      single_[i] = r;
      put(packets8_[i / 8], i % 8, r);
      put(packets16_[i / 16], i % 16, r);
    }
  }
  void one_by_one(std::vector<std::uint8_t>& blocked) const {
    canyon::raytrace::embree::Query query;
    for (std::size_t i = 0; i < count_; ++i) {
      RTCRay ray = single_[i];
      query.occluded1(bare_.scene.get(), &ray);
      blocked[i] = ray.tfar < 0 ? 1 : 0;
    }
  }
  void by_eight(std::vector<std::uint8_t>& blocked) const { by_packets(packets8_, blocked); }
  void by_sixteen(std::vector<std::uint8_t>& blocked) const { by_packets(packets16_, blocked); }

 private:
  template <typename Packet>
  static void put(Packet& packet, std::size_t k, const RTCRay& r) {
    packet.org_x[k] = r.org_x;
    packet.org_y[k] = r.org_y;
    packet.org_z[k] = r.org_z;
    packet.tnear[k] = r.tnear;
    packet.dir_x[k] = r.dir_x;
    packet.dir_y[k] = r.dir_y;
    packet.dir_z[k] = r.dir_z;
    packet.time[k] = 0;
    packet.tfar[k] = r.tfar;
    packet.mask[k] = r.mask;
    packet.id[k] = 0;
    packet.flags[k] = 0;
  }
#if RTC_VERSION_MAJOR >= 4
  using Arguments = RTCOccludedArguments;
  static Arguments arguments() {
    Arguments a;
    rtcInitOccludedArguments(&a);
    a.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    return a;
  }
#else
  using Arguments = RTCIntersectContext;
  static Arguments arguments() {
    Arguments a;
    rtcInitIntersectContext(&a);
    a.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    return a;
  }
#endif
  static void trace(const int* valid, RTCScene scene, Arguments& a, RTCRay8& rays) {
#if RTC_VERSION_MAJOR >= 4
    rtcOccluded8(valid, scene, &rays, &a);
#else
    rtcOccluded8(valid, scene, &a, &rays);
#endif
  }
  static void trace(const int* valid, RTCScene scene, Arguments& a, RTCRay16& rays) {
#if RTC_VERSION_MAJOR >= 4
    rtcOccluded16(valid, scene, &rays, &a);
#else
    rtcOccluded16(valid, scene, &a, &rays);
#endif
  }
  template <typename Packet>
  void by_packets(const std::vector<Packet>& packets, std::vector<std::uint8_t>& blocked) const {
    constexpr std::size_t kWidth = sizeof(Packet::tfar) / sizeof(float);
    alignas(64) std::array<int, kWidth> valid;
    valid.fill(-1);
    Arguments context = arguments();
    for (std::size_t i = 0; i < count_; i += kWidth) {
      Packet rays = packets[i / kWidth];
      trace(valid.data(), bare_.scene.get(), context, rays);
      for (std::size_t k = 0; k < std::min(kWidth, count_ - i); ++k) {
        blocked[i + k] = rays.tfar[k] < 0 ? 1 : 0;
      }
    }
  }

  canyon::bench::BareScene bare_;
  std::size_t count_ = 0;
  std::vector<RTCRay> single_;
  std::vector<RTCRay8> packets8_;
  std::vector<RTCRay16> packets16_;
};

struct Fixture {
  canyon::bench::BenchCity city = canyon::bench::bench_city();
  std::vector<Vector3d> sky = canyon::bench::spread_sky(12);
  std::vector<CellPlane> tiles;
  std::uint32_t columns = 0, rows = 0;
  ShadowCaster caster{city.city.mesh};
  RayScene scene{city.city.mesh};
  BareEmbree bare{city.city.mesh};

  Fixture() {
    const canyon::city::Box bounds = city.city.bounds();
    const Eigen::Vector2d first = bounds.min.head<2>() + Eigen::Vector2d(0.5, 0.5);
    columns = static_cast<std::uint32_t>(std::ceil(bounds.max.x() - bounds.min.x()));
    rows = static_cast<std::uint32_t>(std::ceil(bounds.max.y() - bounds.min.y()));
    for (std::uint32_t r = 0; r < rows; r += kTile) {
      for (std::uint32_t c = 0; c < columns; c += kTile) {
        tiles.push_back(
            {first + Eigen::Vector2d(c, r), 1, std::min(kTile, columns - c), std::min(kTile, rows - r), 15});
      }
    }
  }
  std::size_t rays() const { return std::size_t{columns} * rows * sky.size(); }
};

Fixture& fixture() {
  static Fixture fixture;
  return fixture;
}

void Construction(benchmark::State& state) {
  const Mesh& mesh = fixture().city.city.mesh;
  for (auto _ : state) {
    const ShadowCaster caster(mesh);
    benchmark::DoNotOptimize(&caster);
  }
}
BENCHMARK(Construction)->Unit(benchmark::kMillisecond);

/// The whole map with the sky's satellites at one elevation, or all of it (0).
void Shadows(benchmark::State& state) {
  const Fixture& f = fixture();
  std::vector<std::uint8_t> blocked(kMaxCells);
  std::vector<Vector3d> sky = f.sky;
  if (state.range(0) > 0) {
    for (std::size_t i = 0; i < sky.size(); ++i) {
      sky[i] = canyon::geodesy::enu_from_azimuth_elevation(
          0.3 + 0.52 * static_cast<double>(i), canyon::geodesy::radians(static_cast<double>(state.range(0))));
    }
  }
  for (auto _ : state) {
    for (const CellPlane& tile : f.tiles) {
      for (const Vector3d& direction : sky) {
        f.caster.shadows(tile, direction, {blocked.data(), std::size_t{tile.columns} * tile.rows});
        benchmark::DoNotOptimize(blocked.data());
      }
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(f.rays()));
}
BENCHMARK(Shadows)->Unit(benchmark::kMillisecond)->Arg(0)->Arg(3)->Arg(10)->Arg(30)->Arg(60);

void Ranges(benchmark::State& state) {
  const Fixture& f = fixture();
  std::vector<float> ranges(kMaxCells);
  const double limit =
      state.range(0) > 0 ? static_cast<double>(state.range(0)) : std::numeric_limits<double>::infinity();
  for (auto _ : state) {
    for (const CellPlane& tile : f.tiles) {
      for (const Vector3d& direction : f.sky) {
        f.caster.ranges(tile, direction, limit, {ranges.data(), std::size_t{tile.columns} * tile.rows});
        benchmark::DoNotOptimize(ranges.data());
      }
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(f.rays()));
}
BENCHMARK(Ranges)->Unit(benchmark::kMillisecond)->Arg(100)->Arg(0);

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

void print_ratios() {
  Fixture& f = fixture();
  std::vector<std::uint8_t> bare(kMaxCells), other(kMaxCells);
  std::vector<float> ranges(kMaxCells);
  std::vector<Ray> rays(kMaxCells);
  const auto flags = std::make_unique<bool[]>(kMaxCells);
  std::size_t blocked = 0, different = 0, beyond_1_mm = 0;
  double farthest = 0;

  const CellPlane* tile = nullptr;
  Vector3d direction;
  std::size_t cells = 0;
  struct Method {
    const char* name;
    std::function<void()> result;
    bool compared;  ///< its results are in `other`
    std::vector<double> seconds, ratios;
  };
  std::vector<Method> routes{
      {"bare Embree, single rays", [&] { f.bare.one_by_one(bare); }, false, {}, {}},
      {"bare Embree, packets of 8", [&] { f.bare.by_eight(other); }, false, {}, {}},
      {"bare Embree, packets of 16", [&] { f.bare.by_sixteen(other); }, false, {}, {}},
      {"RayScene, all at once",
       [&] {
         f.scene.occluded({rays.data(), cells}, {flags.get(), cells});
       },
       false,
       {},
       {}},
      {"ShadowCaster::shadows",
       [&] {
         f.caster.shadows(*tile, direction, {other.data(), cells});
       },
       true,
       {},
       {}},
      {"ShadowCaster::ranges, 100 m",
       [&] {
         f.caster.ranges(*tile, direction, kMirrorRange_m, {ranges.data(), cells});
       },
       false,
       {},
       {}},
  };
  for (int round = 0; round < kRounds; ++round) {
    for (Method& route : routes) route.seconds.push_back(0);
    for (const CellPlane& t : f.tiles) {
      for (const Vector3d& d : f.sky) {
        tile = &t;
        direction = d;
        cells = std::size_t{t.columns} * t.rows;
        f.bare.prepare(t, d);
        for (std::uint32_t i = 0; i < cells; ++i) {
          rays[i] = {canyon::heatmap::reference::cell_point(t, i % t.columns, i / t.columns), d};
        }
        for (Method& route : routes) {
          const double start = cpu_seconds();
          route.result();
          route.seconds.back() += cpu_seconds() - start;
          if (!route.compared || round > 0) continue;
          for (std::size_t i = 0; i < cells; ++i) {
            blocked += bare[i];
            if (other[i] == bare[i]) continue;
            ++different;
            const double distance =
                canyon::heatmap::reference::distance_to_edge(f.city.city.mesh, rays[i].origin, d);
            beyond_1_mm += distance > 1e-3 ? 1 : 0;
            farthest = std::max(farthest, distance);
          }
        }
      }
    }
    for (Method& route : routes) route.ratios.push_back(routes[0].seconds.back() / route.seconds.back());
  }
  fmt::print("{}, {} x {} cells of 1 m at 15 m, {} satellites: {} rays, {} blocked; CPU time of one thread\n",
             f.city.city.name, f.columns, f.rows, f.sky.size(), f.rays(), blocked);
  for (const Method& route : routes) {
    fmt::print("{:<44} {:8.2f} million rays/s, {:6.2f} times the bare loop\n", route.name,
               static_cast<double>(f.rays()) / median(route.seconds) / 1e6, median(route.ratios));
  }
  fmt::print(
      "shadows differ from the bare loop's in {} cells, {} of them farther than 1 mm from an edge; "
      "the farthest {:.3f} mm\n",
      different, beyond_1_mm, 1e3 * farthest);
}

/// Tiles distributed to threads: the wall time of short runs with one and two threads alternately. Runs with
/// a core used by another program (CPU time of a thread below 0.97 of its wall time) do not count.
void print_threads() {
  const Fixture& f = fixture();
  struct Run {
    double wall_s = 0, cpu_s = 0;  ///< CPU time of all threads
    bool undisturbed = true;
  };
  const auto now = [] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  };
  const auto run = [&](int threads) {
    std::atomic<std::size_t> next{0};
    std::atomic<bool> disturbed{false};
    std::vector<double> cpu(static_cast<std::size_t>(threads));
    const double start = now();
    std::vector<std::thread> workers;
    for (int i = 0; i < threads; ++i) {
      workers.emplace_back([&, i] {
        const double cell_start = now(), cpu_start = cpu_seconds();
        std::vector<std::uint8_t> blocked(kMaxCells);
        for (std::size_t t = next++; t < f.tiles.size(); t = next++) {
          const CellPlane& tile = f.tiles[t];
          for (const Vector3d& direction : f.sky) {
            f.caster.shadows(tile, direction, {blocked.data(), std::size_t{tile.columns} * tile.rows});
          }
        }
        const double cell_cpu = cpu_seconds() - cpu_start;
        if (cell_cpu < 0.97 * (now() - cell_start)) disturbed = true;
        cpu[static_cast<std::size_t>(i)] = cell_cpu;
      });
    }
    for (std::thread& worker : workers) worker.join();
    return Run{now() - start, std::accumulate(cpu.begin(), cpu.end(), 0.0), !disturbed};
  };
  constexpr int kTries = 400;
  std::vector<double> one, two, by_cpu;
  for (int i = 0; i < kTries; ++i) {
    const Run alone = run(1), together = run(2);
    by_cpu.push_back(2 * alone.cpu_s / together.cpu_s);
    if (alone.undisturbed) one.push_back(alone.wall_s);
    if (together.undisturbed) two.push_back(together.wall_s);
  }
  fmt::print(
      "two threads over tiles: {:.2f} times the speed of one by the CPU time that both take together\n",
      median(by_cpu));
  if (one.empty() || two.empty()) {
    fmt::print("  by wall time not measured, the machine is busy\n");
  } else {
    fmt::print("  {:.2f} by wall time, medians of {} and {} runs that no other program disturbed\n",
               median(one) / median(two), one.size(), two.size());
  }
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  print_ratios();
  print_threads();
  return 0;
}
