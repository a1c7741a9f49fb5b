// Line-of-sight queries through RayScene compared with a bare Embree loop over the same rays, in one program.
//
// The rays are those of a drive: fifty satellites over the sky seen from points along the street, in the Hong
// Kong mesh if the shared data are available, else in the synthetic city. Finally the program measures both
// loops alternately and prints the ratio, which unlike the rates does not depend on the machine.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <vector>

#include "canyon/city/raytrace/embree.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "tests/support/bare_embree.hpp"
#include "tests/support/bench_city.hpp"

namespace {

using canyon::city::Mesh;
using canyon::raytrace::Ray;
using canyon::raytrace::RayScene;
using Eigen::Vector3d;

/// A minimal loop with Embree alone: single occlusion rays, floats prepared beforehand.
class BareEmbree {
 public:
  BareEmbree(const Mesh& mesh, const std::vector<Ray>& rays) : bare_(mesh) {
    for (const Ray& ray : rays) {
      RTCRay r{};
      r.org_x = static_cast<float>(ray.origin.x());
      r.org_y = static_cast<float>(ray.origin.y());
      r.org_z = static_cast<float>(ray.origin.z());
      r.dir_x = static_cast<float>(ray.direction.x());
      r.dir_y = static_cast<float>(ray.direction.y());
      r.dir_z = static_cast<float>(ray.direction.z());
      r.tfar = std::numeric_limits<float>::infinity();
      r.mask = 0xFFFFFFFFu;
      rays_.push_back(r);
    }
  }
  std::size_t blocked() const {
    std::size_t count = 0;
    canyon::raytrace::embree::Query query;
    for (RTCRay ray : rays_) {
      query.occluded1(bare_.scene.get(), &ray);
      count += ray.tfar < 0 ? 1 : 0;
    }
    return count;
  }

 private:
  canyon::bench::BareScene bare_;
  std::vector<RTCRay> rays_;
};

struct Fixture {
  canyon::bench::BenchCity city = canyon::bench::bench_city();
  std::vector<Ray> rays;
  RayScene scene{city.city.mesh};
  std::unique_ptr<BareEmbree> bare;
  std::unique_ptr<bool[]> result;

  Fixture() {
    const std::vector<Vector3d> sky = canyon::bench::spread_sky(50);
    for (const Vector3d& point : city.positions) {
      for (const Vector3d& direction : sky) rays.push_back({point, direction});
    }
    bare = std::make_unique<BareEmbree>(city.city.mesh, rays);
    result = std::make_unique<bool[]>(rays.size());
  }
  std::size_t ours() const {
    scene.occluded(rays, {result.get(), rays.size()});
    return static_cast<std::size_t>(std::count(result.get(), result.get() + rays.size(), true));
  }
  std::size_t ours_one_by_one() const {
    std::size_t count = 0;
    for (const Ray& ray : rays) count += scene.occluded(ray) ? 1 : 0;
    return count;
  }
};

const Fixture& fixture() {
  static const Fixture fixture;
  return fixture;
}

void BareLoop(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(fixture().bare->blocked());
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(fixture().rays.size()));
}
BENCHMARK(BareLoop)->Unit(benchmark::kMillisecond);

void RaySceneBatch(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(fixture().ours());
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(fixture().rays.size()));
}
BENCHMARK(RaySceneBatch)->Unit(benchmark::kMillisecond);

void RaySceneOneByOne(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(fixture().ours_one_by_one());
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(fixture().rays.size()));
}
BENCHMARK(RaySceneOneByOne)->Unit(benchmark::kMillisecond);

template <typename Loop>
double seconds(const Loop& loop) {
  const auto start = std::chrono::steady_clock::now();
  benchmark::DoNotOptimize(loop());
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Median of the ratios of 101 alternating rounds, so that a change of the machine's speed affects both.
void print_ratio() {
  std::vector<double> batch, single;
  for (int i = 0; i < 101; ++i) {
    const double bare = seconds([] { return fixture().bare->blocked(); });
    batch.push_back(bare / seconds([] { return fixture().ours(); }));
    single.push_back(bare / seconds([] { return fixture().ours_one_by_one(); }));
  }
  const auto median = [](std::vector<double>& v) {
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
    return v[v.size() / 2];
  };
  fmt::print("{}, {} rays of {} places; blocked: bare loop {}, RayScene {}\n", fixture().city.city.name,
             fixture().rays.size(), fixture().city.positions.size(), fixture().bare->blocked(),
             fixture().ours());
  fmt::print("rate of RayScene over rate of the bare Embree loop: batch {:.2f}, one by one {:.2f}\n",
             median(batch), median(single));
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  print_ratio();
  return 0;
}
