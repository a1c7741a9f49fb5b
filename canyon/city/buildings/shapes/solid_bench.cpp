#include "canyon/city/buildings/shapes/solid.hpp"

#include <benchmark/benchmark.h>

#include <cmath>
#include <string>
#include <vector>

#include "canyon/city/city.hpp"

namespace canyon::buildings {
namespace {

const Polygon2 kEll{{{0, 0}, {20, 0}, {20, 8}, {9, 8}, {9, 18}, {0, 18}}, {}};
const Polygon2 kHouse{{{0, 0}, {12, 0}, {12, 8}, {0, 8}}, {}};

/// Items are solids.
void append(benchmark::State& state, const Polygon2& polygon, RoofShape roof) {
  Shape shape;
  shape.roof = roof;
  shape.height_m = 9;
  shape.roof_height_m = roof == RoofShape::Flat ? 0 : 3;
  std::vector<std::string> notes;
  city::Mesh mesh;
  for (auto _ : state) {
    if (mesh.triangles.size() > 1000000) mesh = {};
    append_solid(mesh, "house", city::Surface::Building, polygon, shape, 0, 0, notes);
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK_CAPTURE(append, prism_of_6, kEll, RoofShape::Flat);
BENCHMARK_CAPTURE(append, gabled_house, kHouse, RoofShape::Gabled);
BENCHMARK_CAPTURE(append, hipped_of_6, kEll, RoofShape::Hipped);
BENCHMARK_CAPTURE(append, mansard_house, kHouse, RoofShape::Mansard);
BENCHMARK_CAPTURE(append, round_house, kHouse, RoofShape::Round);
BENCHMARK_CAPTURE(append, dome_house, kHouse, RoofShape::Dome);

/// Repair and prism of an outline as in maps, in city coordinates.
void from_outline(benchmark::State& state) {
  Polygon2 raw = kEll;
  for (Point2& p : raw.outer) p += Point2(1234.5678, -987.6543);
  Shape shape;
  city::Mesh mesh;
  for (auto _ : state) {
    if (mesh.triangles.size() > 1000000) mesh = {};
    std::vector<std::string> notes;
    for (const Polygon2& polygon : repair({raw}, notes)) {
      append_solid(mesh, "house", city::Surface::Building, polygon, shape, 0, 0, notes);
    }
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(from_outline);

/// Corners of one outline with a ragged edge.
void triangulate_ragged(benchmark::State& state) {
  Polygon2 polygon;
  for (int i = 0; i < state.range(0); ++i) {
    const double angle = 2 * M_PI * i / static_cast<double>(state.range(0)), r = i % 2 == 0 ? 100 : 90;
    polygon.outer.emplace_back(r * std::cos(angle), r * std::sin(angle));
  }
  for (auto _ : state) benchmark::DoNotOptimize(triangulate(polygon));
  state.SetComplexityN(state.range(0));
}
BENCHMARK(triangulate_ragged)->RangeMultiplier(8)->Range(8, 4096)->Complexity();

}  // namespace
}  // namespace canyon::buildings

BENCHMARK_MAIN();
