#include "canyon/analysis/heatmap/kernels/tile_tracer.hpp"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <memory>
#include <random>
#include <utility>

#include "canyon/analysis/heatmap/kernels/tile_interior.hpp"
#include "canyon/analysis/heatmap/kernels/tile_terrain.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/circular_sky.hpp"
#include "tests/support/shadow_reference.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::heatmap {
namespace {

using city::Material;
using city::Mesh;
using city::Surface;
using Eigen::Vector2d;
using Eigen::Vector3d;
using propagation::Model;
using propagation::PropagationOptions;
using propagation::Visibility;
using test::CircularSky;

constexpr geodesy::GpsTime kTime = CircularSky::kEpoch + std::chrono::hours(5);
constexpr double kMask = 0.17453292519943295;  // 10 deg

const geodesy::Geodetic kOrigin = geodesy::Geodetic::from_degrees(22.3, 114.17, 0);

simulation::Environment environment_of(Mesh mesh) {
  city::City city;
  city.name = "test";
  city.frame = geodesy::LocalFrame(kOrigin);
  city.mesh = std::move(mesh);
  return {std::move(city), std::make_shared<CircularSky>(std::vector{gnss::System::GPS})};
}

PropagationOptions model(Model model, int order = 1) {
  PropagationOptions options;
  options.model = model;
  options.reflection_order = order;
  return options;
}

Tile whole(const Grid& grid) {
  return {0, 0, grid.columns, grid.rows};
}

/// A sheet z = height(x, y) over [-size, size]^2 in squares of `step`.
template <class Height>
void append_terrain(Mesh& mesh, double size, double step, const Height& height) {
  std::vector<Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  const int count = static_cast<int>(std::lround(2 * size / step));
  for (int y = 0; y <= count; ++y) {
    for (int x = 0; x <= count; ++x) {
      const double east = -size + x * step, north = -size + y * step;
      vertices.emplace_back(east, north, height(east, north));
    }
  }
  const auto at = [&](int x, int y) { return static_cast<std::uint32_t>(y * (count + 1) + x); };
  for (int y = 0; y < count; ++y) {
    for (int x = 0; x < count; ++x) {
      triangles.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      triangles.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  }
  city::append_object(mesh, "terrain", Surface::Terrain, Material::Ground, vertices, triangles);
}

/// Boxes that overlap and touch, some inside out, without floor, without a wall or a roof, on stilts.
Mesh odd_buildings(double lift = 0) {
  Mesh mesh;
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 60; ++i) {
    const Vector3d min(160 * unit(random) - 80, 160 * unit(random) - 80, i % 5 == 0 ? 12 * unit(random) : 0);
    const Vector3d size(3 + 20 * unit(random), 3 + 20 * unit(random), 4 + 40 * unit(random));
    Mesh one;
    canyon::test::append_box(one, "box", Surface::Building, Material::Concrete,
                             min + lift * Vector3d::UnitZ(), min + size + lift * Vector3d::UnitZ(),
                             unit(random));
    if (i % 7 == 0) {
      for (auto& t : one.triangles) std::swap(t[1], t[2]);
    }
    if (i % 4 == 0) one.triangles.resize(one.triangles.size() - 1 - static_cast<std::size_t>(i) % 3);
    city::append_object(mesh, "odd", Surface::Building, Material::Concrete, one.vertices, one.triangles);
  }
  return mesh;
}

/// Whether containment() differs at a point within a millimetre of `at`.
bool is_at_a_wall(const raytrace::RayScene& scene, const Vector3d& at) {
  const auto here = scene.containment(at);
  for (int i = 0; i < 16; ++i) {
    const double angle = 2 * geodesy::kPi * i / 16;
    if (scene.containment(at + 1e-3 * Vector3d(std::cos(angle), std::sin(angle), 0)) != here) return true;
  }
  return false;
}

struct StateCount {
  std::size_t cells = 0, inside = 0, under = 0, different = 0;
};
/// Compares every `step`-th cell of a tile with containment(); differences must be at a wall.
StateCount compare_states(const raytrace::RayScene& scene, const TileCells& cells, std::size_t step = 1) {
  StateCount count;
  for (std::size_t i = 0; i < cells.state.size(); i += step) {
    const Vector3d point = cells.centre(i);
    const auto containment = scene.containment(point);
    const CellState expected = containment == raytrace::Containment::Free ? CellState::Computed
                               : containment == raytrace::Containment::UnderTerrain
                                   ? CellState::UnderTerrain
                                   : CellState::InsideBuilding;
    ++count.cells;
    count.inside += expected == CellState::InsideBuilding;
    count.under += expected == CellState::UnderTerrain;
    if (cells.state[i] == expected) continue;
    ++count.different;
    EXPECT_TRUE(is_at_a_wall(scene, point)) << point.transpose();
  }
  return count;
}

struct SignalCount {
  std::size_t signals = 0, nlos = 0, blocked = 0, different = 0;
  double largest_difference_m = 0;
};
/// Compares every `step`-th computed cell with Propagator::trace() at its own point with its own directions
/// to the satellites. Reception may differ only within `edge_m` of an edge, found by moving the point.
SignalCount compare_signals(const simulation::Environment& environment, const PropagationOptions& options,
                            const TileCells& cells, const TileSignals& signals, std::size_t step,
                            double edge_m) {
  const propagation::Propagator propagator = environment.make_propagator(options);
  const geodesy::LocalFrame& frame = environment.city().frame;
  SignalCount count;
  std::vector<propagation::SatellitePaths> paths(signals.satellites.size()), moved(paths.size());
  for (std::size_t i = 0; i < cells.state.size(); i += step) {
    if (cells.state[i] != CellState::Computed) {
      for (std::size_t k = 0; k < paths.size(); ++k) {
        EXPECT_EQ(signals.visibility[k][i], CellVisibility::Blocked);
        EXPECT_EQ(signals.excess_m[k][i], 0);
      }
      continue;
    }
    const Vector3d point = cells.centre(i);
    std::vector<Vector3d> directions;
    for (const orbit::LineOfSight& satellite : signals.satellites) {
      const auto line =
          orbit::line_of_sight(environment.sky(), satellite.id, kTime, frame.ecef_from_local(point));
      directions.emplace_back(frame.ecef_from_local_rotation().transpose() * line->direction_ecef);
    }
    propagator.trace(point, directions, paths);
    for (std::size_t k = 0; k < paths.size(); ++k) {
      ++count.signals;
      const auto visibility_of = [](const propagation::SatellitePaths& p) {
        return p.visibility == Visibility::Blocked ? CellVisibility::Blocked
               : p.visibility == Visibility::NLOS  ? CellVisibility::NLOS
                                                   : CellVisibility::LOS;
      };
      const CellVisibility expected = visibility_of(paths[k]);
      count.nlos += expected == CellVisibility::NLOS;
      count.blocked += expected == CellVisibility::Blocked;
      const double difference =
          std::abs(static_cast<double>(signals.excess_m[k][i]) - paths[k].tracked_excess_m());
      // Floats; directions rotated by 1e-5 rad change an excess of some hundred metres by millimetres.
      if (signals.visibility[k][i] == expected && difference < 0.02) {
        count.largest_difference_m = std::max(count.largest_difference_m, difference);
        continue;
      }
      ++count.different;
      bool at_an_edge = false;
      for (int round = 0; round < 12 && !at_an_edge; ++round) {
        for (const double fraction : {1.0, 0.3}) {
          const double angle = 2 * geodesy::kPi * round / 12;
          const Vector3d shift = fraction * edge_m * Vector3d(std::cos(angle), std::sin(angle), 0);
          propagator.trace(point + shift, std::span(directions).subspan(k, 1), std::span(moved).first(1));
          at_an_edge |= visibility_of(moved[0]) == signals.visibility[k][i] &&
                        std::abs(static_cast<double>(signals.excess_m[k][i]) - moved[0].tracked_excess_m()) <
                            0.02 + 2 * edge_m;
        }
      }
      EXPECT_TRUE(at_an_edge) << point.transpose() << " " << to_string(signals.satellites[k].id) << ": "
                              << static_cast<int>(signals.visibility[k][i]) << " for "
                              << static_cast<int>(expected) << ", " << signals.excess_m[k][i] << " m for "
                              << paths[k].tracked_excess_m() << " m";
    }
  }
  return count;
}

void print(const char* what, const StateCount& count) {
  std::cout << what << ": " << count.cells << " cells, " << count.inside << " inside, " << count.under
            << " under terrain, " << count.different << " different\n";
}
void print(const char* what, const SignalCount& count) {
  std::cout << what << ": " << count.signals << " signals, " << count.nlos << " NLOS, " << count.blocked
            << " blocked, " << count.different << " different at edges, else within "
            << count.largest_difference_m << " m\n";
}

TEST(TerrainHeights, AreThoseOfRays) {
  Mesh mesh;
  append_terrain(mesh, 100, 7.3, [](double x, double y) { return 5 * std::sin(x / 20) + 0.1 * y; });
  append_terrain(mesh, 12, 4, [](double x, double) { return 14 + 0.2 * x; });  // a second sheet
  const TerrainHeights terrain(mesh);
  const raytrace::RayScene scene(mesh);
  Grid grid = Grid::covering(-120, -110, 120, 110, 1.7);
  grid.tile_size = 50;
  std::size_t none = 0;
  for (std::size_t t = 0; t < grid.tile_count(); ++t) {
    const Tile tile = grid.tile(t);
    std::vector<double> heights(tile.cells());
    terrain.heights(grid, tile, heights);
    for (std::uint32_t r = 0; r < tile.rows; ++r) {
      for (std::uint32_t c = 0; c < tile.columns; ++c) {
        const Vector2d at = grid.centre(tile.first_column + c, tile.first_row + r);
        const auto expected = scene.terrain_height(at.x(), at.y());
        const double height = heights[std::size_t{r} * tile.columns + c];
        none += !expected;
        ASSERT_EQ(std::isnan(height), !expected) << at.transpose();
        if (expected) {
          ASSERT_NEAR(height, *expected, 1e-3) << at.transpose();
        }
      }
    }
  }
  EXPECT_GT(none, 100U);
  EXPECT_TRUE(TerrainHeights(odd_buildings()).empty());
}

// Closed form: heights on a plane are those of the plane.
TEST(TerrainHeights, AreExactOnAPlane) {
  Mesh mesh;
  append_terrain(mesh, 60, 3, [](double x, double y) { return 0.3 * x - 0.7 * y + 11; });
  const Grid grid = Grid::covering(-59, -59, 59, 59, 0.37);
  std::vector<double> heights(grid.cells());
  TerrainHeights(mesh).heights(grid, whole(grid), heights);
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const Vector2d at = grid.centre(static_cast<std::uint32_t>(i % grid.columns),
                                    static_cast<std::uint32_t>(i / grid.columns));
    ASSERT_NEAR(heights[i], 0.3 * at.x() - 0.7 * at.y() + 11, 1e-9);
  }
}

TEST(TileTracer, StatesAreThoseOfPlacement) {
  for (const double z : {0.7, 6.3, 15.2, 27.1}) {
    const simulation::Environment odd = environment_of(odd_buildings());
    const TileTracer tracer(odd, model(Model::Mirror), kMask);
    const Grid grid = Grid::covering(-90, -91, 92, 90, 0.83);
    const TileCells cells = tracer.cells(grid, whole(grid), nullptr, z, AltitudeKind::AboveTerrain);
    EXPECT_TRUE(cells.flat());
    EXPECT_EQ(cells.plane.z, z);
    const StateCount count = compare_states(odd.scene(), cells);
    print("odd buildings", count);
    std::cout << Interiors(odd.city().mesh).open_ends(z) << " open ends\n";
    EXPECT_GT(count.inside, z < 20 ? 2000U : 300U);
    EXPECT_LT(count.different, count.cells / 1000);
  }
  EXPECT_GT(Interiors(odd_buildings()).open_ends(6.3), 4U);
}

// Trees over streets and over buildings without a roof, and a plane with more wall ends than are counted.
TEST(TileTracer, FoliageIsNoRoofAndManyOpenWallsAreLeftToRays) {
  Mesh mesh = odd_buildings();
  canyon::test::append_box(mesh, "crown", Surface::Foliage, Material::Foliage, {-60, -60, 30}, {60, 60, 34});
  Mesh sheets = mesh;
  for (int i = 0; i < 250; ++i) {
    const double x = -80 + 0.6 * i;
    city::append_object(sheets, "sheet", Surface::Building, Material::Concrete,
                        {{x, 85, 0}, {x, 86, 0}, {x, 86, 40}, {x, 85, 40}}, {{0, 1, 2}, {0, 2, 3}});
  }
  EXPECT_GT(Interiors(sheets).open_ends(10.4), 400U);
  for (Mesh* each : {&mesh, &sheets}) {
    const simulation::Environment environment = environment_of(*each);
    const TileTracer tracer(environment, model(Model::Mirror), kMask);
    const Grid grid = Grid::covering(-90, -90, 90, 90, 1.31);
    const StateCount count = compare_states(
        environment.scene(), tracer.cells(grid, whole(grid), nullptr, 10.4, AltitudeKind::AboveTerrain));
    print("under foliage", count);
    EXPECT_GT(count.inside, 1000U);
    EXPECT_LT(count.different, count.cells / 500);
  }
}

TEST(TileTracer, StatesOverSlopesAndBelowThem) {
  Mesh mesh = odd_buildings(-6);
  append_terrain(mesh, 70, 9, [](double x, double y) { return 4 * std::sin(x / 15) + 0.05 * y; });
  const simulation::Environment environment = environment_of(std::move(mesh));
  const TileTracer tracer(environment, model(Model::Mirror), kMask);
  const Grid grid = Grid::covering(-90, -90, 90, 90, 1.9);
  const TileCells above = tracer.cells(grid, whole(grid), nullptr, 2, AltitudeKind::AboveTerrain);
  EXPECT_FALSE(above.flat());
  std::size_t without = 0;
  for (std::size_t i = 0; i < above.state.size(); ++i) {
    const Vector3d point = above.centre(i);
    const auto height = environment.scene().terrain_height(point.x(), point.y());
    ASSERT_EQ(above.state[i] == CellState::NoTerrain, !height);
    without += !height;
    if (height) {
      ASSERT_NEAR(point.z(), *height + 2, 2e-3);
    }
    ASSERT_NE(above.state[i], CellState::UnderTerrain);
  }
  EXPECT_GT(without, 1000U);

  // At a level: partly below the ground. Without terrain the points still exist.
  for (const double altitude : {0.5, -1.0}) {
    const TileCells level = tracer.cells(grid, whole(grid), nullptr, altitude, AltitudeKind::Ellipsoid);
    const StateCount count = compare_states(environment.scene(), level);
    print("level", count);
    EXPECT_GT(count.under, 1000U);
    EXPECT_GT(count.inside, 100U);
    EXPECT_LT(count.different, count.cells / 500);
  }
  // Buried on purpose.
  const TileCells buried = tracer.cells(grid, whole(grid), nullptr, -0.5, AltitudeKind::AboveTerrain);
  const auto under = std::count(buried.state.begin(), buried.state.end(), CellState::UnderTerrain);
  EXPECT_GT(under, 3000);
}

TEST(TileTracer, EllipsoidHeightsAreHeightsOfThePlace) {
  const simulation::Environment field = environment_of({});
  const TileTracer tracer(field, model(Model::Mirror), kMask);
  const Grid grid = Grid::covering(19'900, -30'100, 20'100, -29'900, 10);
  const TileCells cells = tracer.cells(grid, whole(grid), nullptr, 57.25, AltitudeKind::Ellipsoid);
  for (std::size_t i = 0; i < cells.state.size(); ++i) {
    ASSERT_EQ(cells.state[i], CellState::Computed);
    // Flat within 1 mm or floats of z (100 m: 8e-6 m).
    ASSERT_NEAR(field.city().frame.geodetic_from_local(cells.centre(i)).height_m, 57.25, 0.6e-3);
  }
  EXPECT_THROW((void)tracer.cells(grid, whole(grid), nullptr, std::numeric_limits<double>::infinity(),
                                  AltitudeKind::Ellipsoid),
               InputError);
}

TEST(TileTracer, CellsOutsideTheAreaAreNotComputed) {
  const simulation::Environment city = environment_of(city::synthetic_city({}).mesh);
  const TileTracer tracer(city, model(Model::Mirror), kMask);
  Grid grid = Grid::covering(-100, -100, 100, 100, 2);
  const Area area{{{{-80, -70}, {90, -20}, {10, 85}}}};
  const TileCells cells = tracer.cells(grid, whole(grid), &area, 15, AltitudeKind::AboveTerrain);
  TileSignals signals;
  tracer.trace(cells, kTime, true, signals);
  std::size_t outside = 0;
  for (std::size_t i = 0; i < cells.state.size(); ++i) {
    const bool in = area.contains(cells.centre(i).head<2>());
    ASSERT_EQ(cells.state[i] == CellState::OutsideArea, !in);
    outside += !in;
    if (in) continue;
    for (const auto& visibility : signals.visibility) ASSERT_EQ(visibility[i], CellVisibility::Blocked);
  }
  EXPECT_GT(outside, 1000U);
}

TEST(TileTracer, MirrorModelIsPropagatorsAtEveryCell) {
  const simulation::Environment city = environment_of(city::synthetic_city({}).mesh);
  const PropagationOptions options = model(Model::Mirror);
  const TileTracer tracer(city, options, kMask);
  const Grid grid = Grid::covering(-300, -120, -44, 136, 1);
  const TileCells cells = tracer.cells(grid, whole(grid), nullptr, 15, AltitudeKind::AboveTerrain);
  EXPECT_TRUE(cells.flat());
  compare_states(city.scene(), cells, 7);
  TileSignals signals;
  tracer.trace(cells, kTime, true, signals);
  EXPECT_GE(signals.satellites.size(), 6U);
  for (const orbit::LineOfSight& line : signals.satellites) EXPECT_GE(line.elevation_rad, kMask);
  // Walls of this city run through centres of cells.
  EXPECT_GT(cells.on_walls.size(), 50U);
  EXPECT_LT(cells.on_walls.size(), cells.state.size() / 20);
  const SignalCount count = compare_signals(city, options, cells, signals, 3, 0.02);
  print("mirror", count);
  EXPECT_GT(count.nlos, 1000U);
  EXPECT_GT(count.blocked, 1000U);
  EXPECT_LT(count.different, count.signals / 1000);
  EXPECT_LT(count.largest_difference_m, 0.01);
}

TEST(TileTracer, SpecularModelIsPropagatorsWithEverythingOn) {
  const simulation::Environment city = environment_of(city::synthetic_city({}).mesh);
  PropagationOptions all = model(Model::Specular, 2);
  all.diffraction = true;
  all.diffuse = true;
  for (const PropagationOptions& options : {model(Model::Specular), all}) {
    const TileTracer tracer(city, options, kMask);
    const Grid grid = Grid::covering(-140, -20, -76, 44, options.diffuse ? 4 : 1);
    const TileCells cells = tracer.cells(grid, whole(grid), nullptr, 15, AltitudeKind::AboveTerrain);
    TileSignals signals;
    tracer.trace(cells, kTime, true, signals);
    const SignalCount count = compare_signals(city, options, cells, signals, 1, 0.02);
    print(options.diffuse ? "specular, all" : "specular", count);
    EXPECT_GT(count.nlos, 100U);
    EXPECT_LT(count.different, std::max<std::size_t>(2, count.signals / 500));
  }
}

TEST(TileTracer, SlopesAreTracedByRays) {
  Mesh mesh = odd_buildings();
  append_terrain(mesh, 120, 10, [](double x, double y) { return -10 + 0.08 * x + 0.03 * y; });
  const simulation::Environment city = environment_of(std::move(mesh));
  for (const Model each : {Model::Mirror, Model::Specular}) {
    const TileTracer tracer(city, model(each), kMask);
    const Grid grid = Grid::covering(-80, -80, 80, 80, 2);
    const TileCells cells = tracer.cells(grid, whole(grid), nullptr, 15, AltitudeKind::AboveTerrain);
    EXPECT_FALSE(cells.flat());
    compare_states(city.scene(), cells);
    TileSignals signals;
    tracer.trace(cells, kTime, true, signals);
    const SignalCount count = compare_signals(city, model(each), cells, signals, 1, 0.02);
    print("slope", count);
    EXPECT_GT(count.nlos, 300U);
    EXPECT_LT(count.different, count.signals / 500);
  }
}

// Without `excess` only the line of sight, the same as with it.
TEST(TileTracer, LineOfSightAloneNeedsNoReflections) {
  Mesh mesh = city::synthetic_city({}).mesh;
  canyon::test::append_box(mesh, "tree", Surface::Foliage, Material::Foliage, {-20, -20, 18}, {20, 20, 30});
  const simulation::Environment city = environment_of(std::move(mesh));
  PropagationOptions leaves = model(Model::Specular);
  leaves.through_foliage = true;
  PropagationOptions direct = model(Model::Specular, 0);
  std::vector<std::size_t> los_of;
  for (const PropagationOptions& options : {model(Model::Mirror), model(Model::Specular), leaves, direct}) {
    const TileTracer tracer(city, options, kMask);
    const Grid grid = Grid::covering(-60, -60, 60, 60, 1);
    const TileCells cells = tracer.cells(grid, whole(grid), nullptr, 15, AltitudeKind::AboveTerrain);
    TileSignals with, without;
    tracer.trace(cells, kTime, true, with);
    tracer.trace(cells, kTime, false, without);
    EXPECT_TRUE(without.excess_m.empty());
    ASSERT_EQ(with.visibility.size(), without.visibility.size());
    std::size_t los = 0, different = 0;
    for (std::size_t k = 0; k < with.visibility.size(); ++k) {
      for (std::size_t i = 0; i < cells.state.size(); ++i) {
        ASSERT_NE(without.visibility[k][i], CellVisibility::NLOS);
        const bool clear = without.visibility[k][i] == CellVisibility::LOS;
        // At edges Propagator's rays may find a path clear that was rasterised as blocked.
        different += clear != (with.visibility[k][i] == CellVisibility::LOS);
        los += clear;
      }
    }
    EXPECT_LE(different, 5U);
    los_of.push_back(los);
  }
  EXPECT_EQ(los_of[0], los_of[1]);
  EXPECT_GT(los_of[2], los_of[0] + 1000);  // seen through leaves
  EXPECT_EQ(los_of[3], los_of[0]);
}

TEST(TileTracer, AnyThreadsAndTilesGiveTheSame) {
  const simulation::Environment city = environment_of(city::synthetic_city({}).mesh);
  const TileTracer tracer(city, model(Model::Specular), kMask);
  const Grid grid = Grid::covering(-140, -20, -92, 28, 1);
  std::vector<TileSignals> results(2);
  for (const int threads : {1, 2}) {
    tbb::task_arena arena(threads);
    arena.execute([&] {
      const TileCells cells = tracer.cells(grid, whole(grid), nullptr, 15, AltitudeKind::AboveTerrain);
      tracer.trace(cells, kTime, true, results[static_cast<std::size_t>(threads - 1)]);
    });
  }
  EXPECT_EQ(results[0].visibility, results[1].visibility);
  EXPECT_EQ(results[0].excess_m, results[1].excess_m);
  // A result object that was used before.
  TileSignals again = results[0];
  tracer.trace(tracer.cells(grid, whole(grid), nullptr, 15, AltitudeKind::AboveTerrain),
               kTime + std::chrono::hours(3), true, again);
  tracer.trace(tracer.cells(grid, whole(grid), nullptr, 15, AltitudeKind::AboveTerrain), kTime, true, again);
  EXPECT_EQ(again.excess_m, results[0].excess_m);
}

// Closed form: an infinite wall of height h, d away, covers the lune between the horizon and the plane
// through its top: a fraction atan(h / d) / pi of the hemisphere.
TEST(TileTracer, SkyViewBesideAWallAndInTheOpen) {
  Mesh mesh;
  canyon::test::append_box(mesh, "wall", Surface::Building, Material::Concrete, {-10, -1e5, 0}, {0, 1e5, 30});
  const simulation::Environment wall = environment_of(std::move(mesh));
  const TileTracer tracer(wall, model(Model::Mirror), kMask);
  const Grid grid = Grid::covering(0.5, 0, 60.5, 2, 1);
  const TileCells cells = tracer.cells(grid, whole(grid), nullptr, 2, AltitudeKind::AboveTerrain);
  std::vector<float> fraction(cells.state.size());
  double worst = 0;
  tracer.sky_view(cells, fraction);
  for (std::size_t i = 0; i < fraction.size(); ++i) {
    const double expected = 1 - std::atan(28 / cells.centre(i).x()) / geodesy::kPi;
    worst = std::max(worst, std::abs(static_cast<double>(fraction[i]) - expected));
  }
  std::cout << "sky view within " << worst << "\n";
  EXPECT_LT(worst, 0.01);
  tracer.sky_view(cells, fraction, 1, 1);
  for (const float each : fraction) EXPECT_TRUE(each == 0 || each == 1);
  EXPECT_THROW(tracer.sky_view(cells, fraction, 0, 64), InputError);
  EXPECT_THROW(tracer.sky_view(cells, fraction, 16, 1001), InputError);

  const simulation::Environment field = environment_of({});
  const TileTracer open(field, model(Model::Specular), kMask);
  open.sky_view(open.cells(grid, whole(grid), nullptr, 2, AltitudeKind::AboveTerrain), fraction);
  for (const float each : fraction) EXPECT_EQ(each, 1);
  const Area unknown{{{{500, 500}, {501, 500}, {500, 501}}}};
  open.sky_view(open.cells(grid, whole(grid), &unknown, 2, AltitudeKind::AboveTerrain), fraction);
  for (const float each : fraction) EXPECT_TRUE(std::isnan(each));
}

TEST(TileTracer, RefusesAMaskThatIsNone) {
  const simulation::Environment field = environment_of({});
  EXPECT_THROW(TileTracer(field, {}, -0.1), InputError);
  EXPECT_THROW(TileTracer(field, {}, 1.6), InputError);
  EXPECT_NO_THROW(TileTracer(field, {}, 0));
}

TEST(TileTracer, HongKongAgreesWithRays) {
  CANYON_SHARED_DATA(file, "hongkong/buildings.dae");
  const simulation::Environment city = environment_of(city::read_mesh_city(file, {}).mesh);
  const city::Box bounds = city.city().bounds();
  const PropagationOptions options = model(Model::Mirror);
  const TileTracer tracer(city, options, kMask);
  const Grid grid = Grid::covering(bounds.min.x(), bounds.min.y(), bounds.max.x(), bounds.max.y(), 1);
  std::cout << grid.tile_count() << " tiles, " << Interiors(city.city().mesh).open_ends(15) << " open ends\n";
  StateCount states;
  SignalCount signals;
  for (std::size_t t = 0; t < grid.tile_count(); t += 3) {
    const TileCells cells = tracer.cells(grid, grid.tile(t), nullptr, 15, AltitudeKind::AboveTerrain);
    const bool terrain =
        std::find(cells.state.begin(), cells.state.end(), CellState::NoTerrain) == cells.state.end();
    if (!terrain) continue;  // cells without a point
    const StateCount tile_count = compare_states(city.scene(), cells, 23);
    states.cells += tile_count.cells;
    states.inside += tile_count.inside;
    states.different += tile_count.different;
    TileSignals traced;
    tracer.trace(cells, kTime, true, traced);
    const SignalCount signal_entries = compare_signals(city, options, cells, traced, 101, 0.05);
    signals.signals += signal_entries.signals;
    signals.nlos += signal_entries.nlos;
    signals.blocked += signal_entries.blocked;
    signals.different += signal_entries.different;
    signals.largest_difference_m =
        std::max(signals.largest_difference_m, signal_entries.largest_difference_m);
  }
  print("Hong Kong", states);
  print("Hong Kong", signals);
  EXPECT_GT(states.inside, 1000U);
  EXPECT_LE(states.different, states.cells / 1000);
  EXPECT_GT(signals.nlos, 200U);
  EXPECT_LT(signals.different, signals.signals / 500);
}

}  // namespace
}  // namespace canyon::heatmap
