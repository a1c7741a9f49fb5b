#include "canyon/analysis/heatmap/kernels/shadows.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/shadow_reference.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::heatmap {
namespace {

using city::Material;
using city::Mesh;
using city::Surface;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr float kInfinite = std::numeric_limits<float>::infinity();

Vector3d direction_deg(double azimuth_deg, double elevation_deg) {
  return geodesy::enu_from_azimuth_elevation(geodesy::radians(azimuth_deg), geodesy::radians(elevation_deg));
}

Mesh box(const Vector3d& min, const Vector3d& max, double yaw_rad = 0) {
  Mesh mesh;
  canyon::test::append_box(mesh, "box", Surface::Building, Material::Concrete, min, max, yaw_rad);
  return mesh;
}

CellPlane plane_over(double west, double south, double east, double north, double spacing, double z) {
  return {{west, south},
          spacing,
          static_cast<std::uint32_t>((east - west) / spacing) + 1,
          static_cast<std::uint32_t>((north - south) / spacing) + 1,
          z};
}

std::vector<std::uint8_t> shadows(const ShadowCaster& caster, const CellPlane& plane,
                                  const Vector3d& direction) {
  std::vector<std::uint8_t> blocked(std::size_t{plane.columns} * plane.rows, 7);
  caster.shadows(plane, direction, blocked);
  return blocked;
}

std::vector<float> ranges(const ShadowCaster& caster, const CellPlane& plane, const Vector3d& direction,
                          double max_range_m = std::numeric_limits<double>::infinity()) {
  std::vector<float> result(std::size_t{plane.columns} * plane.rows, -7);
  caster.ranges(plane, direction, max_range_m, result);
  return result;
}

/// Cells whose result differs from RayScene's, and the distance of the farthest of them from an edge.
struct Differences {
  std::size_t cells = 0, blocked = 0, different = 0, beyond_1_mm = 0;
  double farthest_m = 0;
  Vector3d worst = Vector3d::Zero();

  friend std::ostream& operator<<(std::ostream& out, const Differences& d) {
    return out << d.cells << " cells, " << d.blocked << " blocked, " << d.different << " different, "
               << d.beyond_1_mm << " of them farther than 1 mm from an edge, the farthest "
               << d.farthest_m * 1e3 << " mm at " << d.worst.transpose();
  }
};

void compare_shadows(const Mesh& mesh, const raytrace::RayScene& scene, const ShadowCaster& caster,
                     const CellPlane& plane, const Vector3d& direction, Differences& sum) {
  const std::vector<std::uint8_t> ours = shadows(caster, plane, direction);
  std::vector<raytrace::Ray> rays(plane.columns);
  const auto theirs = std::make_unique<bool[]>(plane.columns);
  for (std::uint32_t r = 0; r < plane.rows; ++r) {
    for (std::uint32_t c = 0; c < plane.columns; ++c)
      rays[c] = {reference::cell_point(plane, c, r), direction};
    scene.occluded(rays, {theirs.get(), plane.columns});
    for (std::uint32_t c = 0; c < plane.columns; ++c) {
      const std::uint8_t our = ours[std::size_t{r} * plane.columns + c];
      ++sum.cells;
      sum.blocked += our;
      if (our == (theirs[c] ? 1 : 0)) continue;
      ++sum.different;
      const double distance = reference::distance_to_edge(mesh, rays[c].origin, direction);
      sum.beyond_1_mm += distance > 1e-3 ? 1 : 0;
      if (distance > sum.farthest_m) {
        sum.farthest_m = distance;
        sum.worst = rays[c].origin;
      }
    }
  }
}

/// Compares ranges with RayScene::cast(): cells where only one is hit, or both at different ranges, must be
/// near an edge.
struct RangeDifferences {
  std::size_t cells = 0, hits = 0, different = 0;
  double farthest_m = 0, largest_m = 0;  ///< from an edge; of the matching ranges
};

void compare_ranges(const Mesh& mesh, const raytrace::RayScene& scene, const ShadowCaster& caster,
                    const CellPlane& plane, const Vector3d& direction, double max_range_m,
                    RangeDifferences& sum) {
  const std::vector<float> ours = ranges(caster, plane, direction, max_range_m);
  for (std::uint32_t r = 0; r < plane.rows; ++r) {
    for (std::uint32_t c = 0; c < plane.columns; ++c) {
      const float our = ours[std::size_t{r} * plane.columns + c];
      const raytrace::Ray ray{reference::cell_point(plane, c, r), direction, max_range_m};
      const auto hit = scene.cast(ray);
      ++sum.cells;
      if (!hit && our == kInfinite) continue;
      // Compared to the rounding of the result to a float.
      const double difference =
          hit && our != kInfinite
              ? std::max(0.0, std::abs(static_cast<double>(our) - hit->range_m) - 6e-8 * hit->range_m)
              : 1e9;
      if (difference <= 1e-4) {
        ++sum.hits;
        sum.largest_m = std::max(sum.largest_m, difference);
        continue;
      }
      // A range at the limit may be inside or outside.
      if (hit && std::abs(hit->range_m - max_range_m) < 1e-3) continue;
      if (!hit && std::abs(static_cast<double>(our) - max_range_m) < 1e-3) continue;
      ++sum.different;
      sum.farthest_m = std::max(sum.farthest_m, reference::distance_to_edge(mesh, ray.origin, direction));
    }
  }
}

TEST(ShadowCaster, AnOpenFieldHasNoShadows) {
  const ShadowCaster caster{Mesh{}};
  const CellPlane plane = plane_over(-10, -10, 10, 10, 1, 0);
  for (const std::uint8_t b : shadows(caster, plane, direction_deg(45, 30))) EXPECT_EQ(b, 0);
  for (const float range : ranges(caster, plane, direction_deg(45, 30))) EXPECT_EQ(range, kInfinite);
  caster.shadows({{0, 0}, 1, 0, 0, 0}, {0, 0, 1}, {});
}

TEST(ShadowCaster, ABrokenMeshIsRefused) {
  Mesh mesh = box({0, 0, 0}, {1, 1, 1});
  mesh.triangles[3][1] = 99;
  EXPECT_THROW(ShadowCaster{mesh}, InputError);
}

// Closed form: the shadow of [0, 10] x [0, 4] x [0, 20] with the satellite in the west at 45 degrees covers x
// in [max(0, -z), 30 - z] at height z below 20, y in [0, 4]. Cells at quarters are not on edges.
TEST(ShadowCaster, TheShadowOfABoxLiesAwayFromTheSatellite) {
  const ShadowCaster caster(box({0, 0, 0}, {10, 4, 20}));
  for (const double z : {-3.0, 0.0, 5.0, 19.0, 20.0}) {
    const CellPlane plane = plane_over(-9.75, -9.75, 40, 10, 0.5, z);
    const auto blocked = shadows(caster, plane, direction_deg(270, 45));
    const double from = std::max(0.0, -z);
    for (std::uint32_t r = 0; r < plane.rows; ++r) {
      for (std::uint32_t c = 0; c < plane.columns; ++c) {
        const Vector3d at = reference::cell_point(plane, c, r);
        const bool expected = z < 20 && at.y() > 0 && at.y() < 4 && at.x() > from && at.x() < 30 - z;
        ASSERT_EQ(blocked[std::size_t{r} * plane.columns + c], expected ? 1 : 0) << at.transpose();
      }
    }
  }
}

// Row 0 is the southernmost, column 0 the westernmost: the shadow of a satellite in the south-south-east is
// in the north-north-west, and no symmetry hides a swap.
TEST(ShadowCaster, RowsCountNorthAndColumnsEast) {
  const ShadowCaster caster(box({-1, -1, 0}, {1, 1, 10}));
  const CellPlane plane{{-20.25, -30.25}, 1, 50, 60, 0};
  const Vector3d south_south_east = direction_deg(160, 45);
  const auto blocked = shadows(caster, plane, south_south_east);
  // Half-way down the shadow: 5 m north-north-west of the box.
  const Vector2d shadow = -5 * south_south_east.head<2>().normalized();
  const auto column = static_cast<std::size_t>(std::lround(shadow.x() + 20.25));
  const auto row = static_cast<std::size_t>(std::lround(shadow.y() + 30.25));
  EXPECT_EQ(blocked[row * 50 + column], 1);
  std::size_t north = 0, south = 0;
  for (std::size_t r = 0; r < 60; ++r) {
    for (std::size_t c = 0; c < 50; ++c) (r > 31 ? north : r < 29 ? south : north) += blocked[r * 50 + c];
  }
  EXPECT_GT(north, 10u);
  EXPECT_EQ(south, 0u);
}

// A tile's results do not depend on the division into tiles: spans at the borders of tiles.
TEST(ShadowCaster, TilesFitTogether) {
  const Mesh mesh = city::synthetic_city({}).mesh;
  const ShadowCaster caster(mesh);
  const Vector3d direction = direction_deg(211, 17);
  const CellPlane all = plane_over(-150.3, -120.7, 150, 140, 1.5, 3);
  const auto whole = shadows(caster, all, direction);
  const auto whole_ranges = ranges(caster, all, direction, 90);
  for (const std::uint32_t size : {1U, 7U, 63U, 64U, 65U, 150U}) {
    for (std::uint32_t row = 0; row < all.rows; row += size == 1 ? 37 : size) {
      for (std::uint32_t column = 0; column < all.columns; column += size == 1 ? 41 : size) {
        CellPlane tile = all;
        tile.first += 1.5 * Vector2d(column, row);
        tile.columns = std::min(size, all.columns - column);
        tile.rows = std::min(size, all.rows - row);
        const auto part = shadows(caster, tile, direction);
        const auto part_ranges = ranges(caster, tile, direction, 90);
        for (std::uint32_t r = 0; r < tile.rows; ++r) {
          for (std::uint32_t c = 0; c < tile.columns; ++c) {
            const std::size_t here = std::size_t{r} * tile.columns + c;
            const std::size_t there = std::size_t{row + r} * all.columns + column + c;
            ASSERT_EQ(part[here], whole[there]) << size << ": " << column + c << ", " << row + r;
            if (part_ranges[here] != whole_ranges[there]) {
              ASSERT_NEAR(part_ranges[here], whole_ranges[there], 2e-5) << column + c << ", " << row + r;
            }
          }
        }
      }
    }
  }
}

// Closed form: a satellite in the zenith sees the outline of the highest parts; ranges are heights.
TEST(ShadowCaster, TheZenithShadowIsTheOutline) {
  const ShadowCaster caster(box({0, 0, 10}, {10, 4, 20}));
  const CellPlane below = plane_over(-4.75, -4.75, 15, 10, 0.5, 2);
  const CellPlane within = plane_over(-4.75, -4.75, 15, 10, 0.5, 12);
  const auto blocked = shadows(caster, below, {0, 0, 1});
  const auto heights = ranges(caster, below, {0, 0, 1}, 100);
  const auto to_roof = ranges(caster, within, {0, 0, 1}, 100);
  const auto too_far = ranges(caster, below, {0, 0, 1}, 7.9);
  for (std::uint32_t r = 0; r < below.rows; ++r) {
    for (std::uint32_t c = 0; c < below.columns; ++c) {
      const Vector3d at = reference::cell_point(below, c, r);
      const bool under = at.x() > 0 && at.x() < 10 && at.y() > 0 && at.y() < 4;
      const std::size_t i = std::size_t{r} * below.columns + c;
      ASSERT_EQ(blocked[i], under ? 1 : 0) << at.transpose();
      ASSERT_EQ(heights[i], under ? 8.0F : kInfinite) << at.transpose();
      ASSERT_EQ(to_roof[i], under ? 8.0F : kInfinite) << at.transpose();
      ASSERT_EQ(too_far[i], kInfinite);
    }
  }
}

// Closed form: the wall x = 0 seen from x > 0 towards the west at 30 degrees: range x / cos 30.
TEST(ShadowCaster, RangesToAWallGrowWithDistance) {
  const ShadowCaster caster(box({-10, -50, 0}, {0, 50, 40}));
  const CellPlane plane = plane_over(0.5, -40, 120, 40, 1, 1.5);
  const Vector3d west = direction_deg(270, 30);
  const auto found = ranges(caster, plane, west, 60);
  for (std::uint32_t r = 0; r < plane.rows; ++r) {
    for (std::uint32_t c = 0; c < plane.columns; ++c) {
      const double x = reference::cell_point(plane, c, r).x();
      const double range = x / std::cos(geodesy::radians(30));
      const bool hit = range <= 60 && 1.5 + range * std::sin(geodesy::radians(30)) < 40;
      if (hit) {
        ASSERT_NEAR(found[std::size_t{r} * plane.columns + c], range, 1e-5) << x;
      } else {
        ASSERT_EQ(found[std::size_t{r} * plane.columns + c], kInfinite) << x;
      }
    }
  }
}

// Cells exactly on an edge: no cell inside is missed, none beyond the margin is marked.
TEST(ShadowCaster, CellsOnEdgesLeaveNoGaps) {
  // A fan of 16 open triangles around a corner at a cell's centre; its sides also pass through cells.
  std::vector<Vector3d> vertices{{0, 0, 8}};
  std::vector<std::array<std::uint32_t, 3>> triangles;
  const std::array<Vector2d, 16> rim{{{8, 0},
                                      {8, 4},
                                      {8, 8},
                                      {4, 8},
                                      {0, 8},
                                      {-4, 8},
                                      {-8, 8},
                                      {-8, 4},
                                      {-8, 0},
                                      {-8, -4},
                                      {-8, -8},
                                      {-4, -8},
                                      {0, -8},
                                      {4, -8},
                                      {8, -8},
                                      {8, -4}}};
  for (std::uint32_t i = 0; i < 16; ++i) {
    vertices.emplace_back(rim[i].x(), rim[i].y(), 8);
    triangles.push_back({0, i + 1, (i + 1) % 16 + 1});
  }
  Mesh mesh;
  city::append_object(mesh, "fan", Surface::Building, Material::Concrete, vertices, triangles);
  const ShadowCaster caster(mesh);
  // 3-4-5: shear 3/4 and 0, so that the shadow at z = 0 is the square moved by exactly 6 m to the west.
  const Vector3d direction(0.6, 0, 0.8);
  const CellPlane plane{{-20, -20}, 1, 41, 41, 0};
  const auto blocked = shadows(caster, plane, direction);
  for (int r = 0; r < 41; ++r) {
    for (int c = 0; c < 41; ++c) {
      const int x = c - 20 + 6, y = r - 20;
      const std::uint8_t b = blocked[static_cast<std::size_t>(r * 41 + c)];
      if (std::abs(x) < 8 && std::abs(y) < 8) {
        ASSERT_EQ(b, 1) << x << ", " << y;
      }
      if (std::abs(x) > 8 || std::abs(y) > 8) {
        ASSERT_EQ(b, 0) << x << ", " << y;
      }
    }
  }
}

// A wall is edge-on only along its plane, and then throws no shadow; nor does a wall under the plane.
TEST(ShadowCaster, WhatIsSeenFromItsEdgeOrLiesBelowThrowsNoShadow) {
  Mesh mesh;
  city::append_object(mesh, "wall", Surface::Building, Material::Concrete,
                      {{0, -5, 0}, {0, 5, 0}, {0, 5, 9}, {0, -5, 9}}, {{0, 1, 2}, {0, 2, 3}});
  const ShadowCaster caster(mesh);
  const CellPlane plane{{-20, -20}, 1, 41, 41, 0};
  const auto count = [](const std::vector<std::uint8_t>& blocked) {
    return std::count(blocked.begin(), blocked.end(), 1);
  };
  EXPECT_EQ(count(shadows(caster, plane, {0, 0.6, 0.8})), 0);
  EXPECT_EQ(count(shadows(caster, plane, {0, 0, 1})), 0);
  EXPECT_GT(count(shadows(caster, plane, {0.6, 0, 0.8})), 0);
  CellPlane above = plane;
  above.z = 9;
  EXPECT_EQ(count(shadows(caster, above, {0.6, 0, 0.8})), 0);
  for (const float range : ranges(caster, above, {0.6, 0, 0.8})) EXPECT_EQ(range, kInfinite);
}

// Random triangles of all sizes, slivers among them, against each triangle tested in doubles.
TEST(ShadowCaster, AgreesWithEveryTriangleTestedByItself) {
  std::mt19937_64 random(20260101);
  std::uniform_real_distribution<double> unit(0, 1);
  std::size_t different = 0, cells = 0, blocked_cells = 0;
  double farthest = 0, worst_range = 0;
  for (int round = 0; round < 40; ++round) {
    Mesh mesh;
    std::vector<Vector3d> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (std::uint32_t t = 0; t < 60; ++t) {
      const Vector3d centre(200 * unit(random) - 100, 200 * unit(random) - 100, 60 * unit(random) - 20);
      const double size = std::pow(10.0, 3 * unit(random) - 0.7);
      const double thin = t % 4 == 0 ? 1e-4 : 1;
      const Vector3d long_side = size * Vector3d(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5);
      const Vector3d other =
          thin * size * Vector3d(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5);
      vertices.insert(vertices.end(), {centre, centre + long_side, centre + 0.5 * long_side + other});
      triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    }
    city::append_object(mesh, "soup", Surface::Building, Material::Concrete, vertices, triangles);
    CellPlane plane{{-60 + unit(random), -55 + unit(random)}, 2.3, 50, 45, 10 * unit(random) - 5};
    if (round % 2 == 1) {  // 12 km from the origin
      const Vector3d away(8000, -9000, 100);
      for (Vector3d& v : mesh.vertices) v += away;
      plane.first += away.head<2>();
      plane.z += away.z();
    }
    const ShadowCaster caster(mesh);
    // From 3 degrees to the zenith.
    const Vector3d direction = direction_deg(360 * unit(random), 3 + 87 * std::pow(unit(random), 2));
    const auto ours = shadows(caster, plane, direction);
    const auto our_ranges = ranges(caster, plane, direction);
    for (std::uint32_t r = 0; r < plane.rows; ++r) {
      for (std::uint32_t c = 0; c < plane.columns; ++c) {
        const Vector3d at = reference::cell_point(plane, c, r);
        const auto hit = reference::first_hit(mesh, at, direction);
        const std::size_t i = std::size_t{r} * plane.columns + c;
        ++cells;
        blocked_cells += ours[i];
        // Compared to the rounding of the result to a float.
        const double off = hit ? std::abs(static_cast<double>(our_ranges[i]) - *hit) - 6e-8 * *hit : 0;
        const bool same_range = (our_ranges[i] == kInfinite) == !hit && off <= 1e-6;
        if (same_range) worst_range = std::max(worst_range, off);
        if (ours[i] == (hit ? 1 : 0) && same_range) continue;
        ++different;
        farthest = std::max(farthest, reference::distance_to_edge(mesh, at, direction));
      }
    }
  }
  std::cout << cells << " cells, " << blocked_cells << " blocked, " << different
            << " different, the farthest " << farthest << " m from an edge; ranges within " << worst_range
            << " m\n";
  EXPECT_GT(blocked_cells, cells / 20);
  EXPECT_LT(blocked_cells, cells - cells / 20);
  EXPECT_LE(farthest, 1e-7);
}

/// Boxes that overlap, are on top of one another, inside out, without floor, on stilts; a bow-tie.
Mesh odd_city() {
  Mesh mesh;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 40; ++i) {
    const Vector3d min(160 * unit(random) - 80, 160 * unit(random) - 80, i % 5 == 0 ? 12 * unit(random) : 0);
    const Vector3d size(3 + 20 * unit(random), 3 + 20 * unit(random), 4 + 40 * unit(random));
    Mesh one = box(min, min + size, unit(random));
    std::vector<std::array<std::uint32_t, 3>> triangles = one.triangles;
    if (i % 7 == 0) {
      for (auto& t : triangles) std::swap(t[1], t[2]);  // inside out
    }
    if (i % 3 == 0) {  // no floor
      triangles.erase(std::remove_if(triangles.begin(), triangles.end(),
                                     [&](const auto& t) {
                                       return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) {
                                         return one.vertices[v].z() == min.z();
                                       });
                                     }),
                      triangles.end());
    }
    if (i % 11 == 0) triangles.pop_back();  // a hole
    city::append_object(mesh, "odd", Surface::Building, Material::Concrete, one.vertices, triangles);
  }
  return mesh;
}

TEST(ShadowCaster, AgreesWithRaysOnOddBuildings) {
  const Mesh mesh = odd_city();
  const ShadowCaster caster(mesh);
  const raytrace::RayScene scene(mesh);
  Differences sum;
  RangeDifferences range_sum;
  for (const double z : {-2.0, 0.5, 7.3, 15.0}) {
    for (int i = 0; i < 6; ++i) {
      const Vector3d direction = direction_deg(17 + 61 * i, 4 + 15.5 * i);
      const CellPlane plane = plane_over(-119.7, -119.2, 120, 120, 1, z);
      compare_shadows(mesh, scene, caster, plane, direction, sum);
      compare_ranges(mesh, scene, caster, plane, direction, 70, range_sum);
    }
  }
  std::cout << sum << "\nranges: " << range_sum.hits << " hits within " << range_sum.largest_m << " m, "
            << range_sum.different << " different, the farthest " << range_sum.farthest_m * 1e3
            << " mm from an edge\n";
  EXPECT_GT(sum.blocked, sum.cells / 10);
  EXPECT_LE(sum.farthest_m, 1e-3);
  EXPECT_GT(range_sum.hits, range_sum.cells / 10);
  EXPECT_LE(range_sum.farthest_m, 1e-3);
}

// Threads share a caster.
TEST(ShadowCaster, AnswersOnManyThreadsAtOnce) {
  const ShadowCaster caster(city::synthetic_city({}).mesh);
  const CellPlane plane = plane_over(-150, -150, 150, 150, 1, 15);
  const auto at = [&](int i) { return shadows(caster, plane, direction_deg(40 * i, 8 + 9 * i)); };
  std::vector<std::vector<std::uint8_t>> alone, together(8);
  for (int i = 0; i < 8; ++i) alone.push_back(at(i));
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&, i] { together[static_cast<std::size_t>(i)] = at(i); });
  }
  for (std::thread& t : threads) t.join();
  EXPECT_EQ(alone, together);
}

// Every cell of Hong Kong at 15 m, 1 m apart, twelve satellites from 5 to 85 degrees: as RayScene, but within
// 1 mm of an edge.
TEST(ShadowCaster, AgreesWithRaysOverHongKong) {
  CANYON_SHARED_DATA(file, "hongkong/buildings.dae");
  const city::City city = city::read_mesh_city(file, {});
  const ShadowCaster caster(city.mesh);
  const raytrace::RayScene scene(city.mesh);
  const city::Box bounds = city.bounds();
  const CellPlane plane = plane_over(bounds.min.x() + 0.5, bounds.min.y() + 0.5, bounds.max.x(),
                                     bounds.max.y(), 1, bounds.min.z() + 15);
  Differences sum;
  for (int i = 0; i < 12; ++i) {
    compare_shadows(city.mesh, scene, caster, plane, direction_deg(10 + 137.5 * i, 5 + 80.0 * i / 11), sum);
  }
  std::cout << sum << "\n";
  EXPECT_GT(sum.blocked, sum.cells / 10);
  EXPECT_LE(sum.farthest_m, 1e-3);
  EXPECT_LT(sum.different, sum.cells / 10'000);
}

TEST(ShadowCaster, RangesAgreeWithRaysOverHongKong) {
  CANYON_SHARED_DATA(file, "hongkong/buildings.dae");
  const city::City city = city::read_mesh_city(file, {});
  const ShadowCaster caster(city.mesh);
  const raytrace::RayScene scene(city.mesh);
  const city::Box bounds = city.bounds();
  const CellPlane plane = plane_over(bounds.min.x() + 0.5, bounds.min.y() + 0.5, bounds.max.x(),
                                     bounds.max.y(), 3, bounds.min.z() + 15);
  for (const double max_range_m : {60.0, 1e9}) {
    RangeDifferences sum;
    for (int i = 0; i < 6; ++i) {
      compare_ranges(city.mesh, scene, caster, plane, direction_deg(10 + 137.5 * i, 5 + 16.0 * i),
                     max_range_m, sum);
    }
    std::cout << sum.cells << " cells, " << sum.hits << " hits within " << sum.largest_m << " m, "
              << sum.different << " different, the farthest " << sum.farthest_m * 1e3 << " mm from an edge\n";
    EXPECT_GT(sum.hits, sum.cells / 10);
    EXPECT_LE(sum.farthest_m, 1e-3);
  }
}

}  // namespace
}  // namespace canyon::heatmap
