#include "canyon/paths/propagation/index/facets.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::propagation {
namespace {

using city::Material;
using city::Mesh;
using city::Surface;
using Eigen::Vector3d;

TEST(FacetSet, ABoxHasSixFacetsOfTwoTriangles) {
  Mesh mesh;
  canyon::test::append_box(mesh, "box", Surface::Building, Material::Glass, {-10, -5, 0}, {10, 5, 30}, 0.4);
  const FacetSet set(mesh, false);
  ASSERT_EQ(set.facets().size(), 6u);
  for (const Facet& facet : set.facets()) {
    EXPECT_EQ(facet.count, 2u);
    EXPECT_LT(facet.deviation, 1e-12);
    EXPECT_GT(facet.normal.dot(0.5 * (facet.min + facet.max) - Vector3d(0, 0, 15)), 0) << "outwards";
  }
}

TEST(FacetSet, KeepsPlanesApartThatOnlyTouch) {
  // Two boxes in line: facades in one plane whose triangles have no common edge; only their floors do.
  Mesh mesh;
  canyon::test::append_box(mesh, "a", Surface::Building, Material::Glass, {0, 0, 0}, {10, 10, 20});
  canyon::test::append_box(mesh, "b", Surface::Building, Material::Glass, {10, 0, 0}, {20, 10, 30});
  EXPECT_EQ(FacetSet(mesh, false).facets().size(), 11u);
  // A sheet folded by 1 degree is two facets, by 0.1 degree over 10 m (17 mm) as well, by 1e-3 degree one.
  for (const auto& [fold_deg, facets] : {std::pair{1.0, 2u}, {0.1, 2u}, {1e-3, 1u}}) {
    Mesh fold;
    const double rise = 10 * std::tan(fold_deg * EIGEN_PI / 180);
    city::append_object(fold, "fold", Surface::Building, Material::Glass,
                        {{0, 0, 0}, {10, 0, 0}, {10, 10, 0}, {0, 10, 0}, {-10, 0, rise}, {-10, 10, rise}},
                        {{0, 1, 2}, {0, 2, 3}, {4, 0, 3}, {4, 3, 5}});
    const FacetSet set(fold, false);
    EXPECT_EQ(set.facets().size(), facets) << fold_deg;
    for (const Facet& facet : set.facets()) EXPECT_LE(facet.deviation, 0.5e-3);
  }
}

TEST(FacetSet, TakesWhatReflects) {
  Mesh mesh;
  canyon::test::append_box(mesh, "house", Surface::Building, Material::Glass, {0, 0, 0}, {10, 10, 20});
  canyon::test::append_box(mesh, "tree", Surface::Foliage, Material::Wood, {20, 0, 0}, {30, 10, 20});
  canyon::test::append_box(mesh, "car", Surface::Vehicle, Material::Metal, {40, 0, 0}, {45, 2, 2});
  canyon::test::append_box(mesh, "hill", Surface::Terrain, Material::Ground, {60, 0, 0}, {90, 10, 5});
  EXPECT_EQ(FacetSet(mesh, false).facets().size(), 12u);
  EXPECT_EQ(FacetSet(mesh, true).facets().size(), 18u);
  EXPECT_TRUE(FacetSet(Mesh{}, true).facets().empty());
}

/// A flat disc with a hole, of many triangles with common edges, rotated about an axis.
Mesh ring(int slices, const Eigen::Matrix3d& rotation) {
  std::vector<Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (int i = 0; i < slices; ++i) {
    const double angle = 2 * EIGEN_PI * i / slices;
    const Vector3d out(std::cos(angle), std::sin(angle), 0);
    vertices.push_back(rotation * (10 * out));
    vertices.push_back(rotation * (30 * out));
  }
  const auto n = static_cast<std::uint32_t>(vertices.size());
  for (std::uint32_t i = 0; i < n; i += 2) {
    triangles.push_back({i, i + 1, (i + 3) % n});
    triangles.push_back({i, (i + 3) % n, (i + 2) % n});
  }
  Mesh mesh;
  city::append_object(mesh, "ring", Surface::Building, Material::Glass, vertices, triangles);
  return mesh;
}

TEST(FacetSet, FindsPointsOfOutlinesWithHolesHoweverTheyLie) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const Vector3d& axis :
       {Vector3d(0, 0, 1), Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(1, -2, 0.5)}) {
    for (const double angle : {0.0, 1.5707963267948966, 2.5, 3.141592653589793}) {
      const Eigen::Matrix3d rotation = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
      const FacetSet set(ring(360, rotation), false);
      ASSERT_EQ(set.facets().size(), 1u);
      const Facet& facet = set.facets()[0];
      EXPECT_EQ(facet.count, 720u);
      EXPECT_TRUE(facet.normal.isApprox(rotation.col(2), 1e-12));
      for (int i = 0; i < 2'000; ++i) {
        const double radius = 40 * unit(random), around = 2 * EIGEN_PI * unit(random);
        // The outline is a polygon: its edges lie up to 30 (1 - cos(0.5 deg)) = 1.2 mm within the circles.
        if (std::abs(radius - 10) < 2e-3 || std::abs(radius - 30) < 2e-3) continue;
        const Vector3d point = rotation * Vector3d(radius * std::cos(around), radius * std::sin(around), 0);
        EXPECT_EQ(set.triangle_at(facet, point).has_value(), radius > 10 && radius < 30);
      }
      // Every corner and the middle of every inner edge belong to it.
      for (int i = 0; i < 360; ++i) {
        const double around = 2 * EIGEN_PI * i / 360;
        for (const double radius : {10.0, 20.0, 30.0}) {
          const Vector3d point = rotation * Vector3d(radius * std::cos(around), radius * std::sin(around), 0);
          EXPECT_TRUE(set.triangle_at(facet, point)) << i << " " << radius;
        }
      }
    }
  }
}

// gather() and mark_reflecting() may return too many facets, never too few: compared with the same in doubles
// without blocks.
TEST(FacetSet, TheFastTestNeverMissesAFacet) {
  const city::City city = city::synthetic_city({});
  const FacetSet set(city.mesh, true);
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> coordinate(-300, 300), height(-5, 200), unit(-1, 1);
  NearFacets near;
  FacingFacets facing;
  std::vector<std::uint8_t> marks;
  std::size_t offered = 0, needed = 0;
  for (int i = 0; i < 200; ++i) {
    const Vector3d antenna(coordinate(random), coordinate(random), height(random));
    const double reach = 20 + 280 * std::abs(unit(random));
    // Relative to the antenna, or to a nearby point.
    const double away = i % 2 == 0 ? 0 : 8;
    const Vector3d centre =
        antenna + away * Vector3d(unit(random), unit(random), unit(random)).normalized() * (1 - 1e-9);
    set.gather(centre, away, reach, near);
    facing.fill(near, antenna, 1e-3);
    for (int k = 0; k < 20; ++k) {
      const Vector3d s = Vector3d(unit(random), unit(random), unit(random)).normalized();
      const double min_cosine = k % 2 == 0 ? 1e-6 : 0.0175;
      mark_reflecting(facing, s, min_cosine, reach, marks);
      std::set<std::uint32_t> marked;
      for (std::size_t m = 0; m < marks.size(); ++m) {
        if (marks[m] == 0) continue;
        ASSERT_LT(m, facing.facet.size()) << "padding matches nothing";
        marked.insert(facing.facet[m]);
      }
      offered += marked.size();
      for (std::uint32_t f = 0; f < set.facets().size(); ++f) {
        const Facet& facet = set.facets()[f];
        const double h = facet.normal.dot(antenna) - facet.offset, cosine = facet.normal.dot(s);
        if (h <= 1e-3 + 2 * facet.deviation || cosine < min_cosine || h / cosine > reach) continue;
        const Vector3d point = antenna - 2 * h * facet.normal + h / cosine * s;
        if ((point.array() < facet.min.array() - 1e-9).any() ||
            (point.array() > facet.max.array() + 1e-9).any())
          continue;
        ++needed;
        EXPECT_TRUE(marked.count(f)) << f;
      }
    }
  }
  EXPECT_GT(needed, 1'000u);
  EXPECT_LT(offered, needed + needed / 20 + 200) << "and hardly too much";
}

TEST(FacetSet, HongKongFacetsAreWalls) {
  CANYON_SHARED_DATA(path, "hongkong/buildings.dae");
  city::MeshImportOptions options;
  options.origin = geodesy::Geodetic::from_degrees(22.298251, 114.178761, 0);
  const city::City city = city::read_mesh_city(path, options);
  const FacetSet set(city.mesh, false);
  std::size_t triangles = 0, walls = 0;
  for (const Facet& facet : set.facets()) {
    triangles += facet.count;
    walls += std::abs(facet.normal.z()) < 0.01 ? 1 : 0;
    EXPECT_LE(facet.deviation, 1e-3);
  }
  std::size_t buildings = 0;
  for (const city::Object& object : city.mesh.objects) {
    buildings += object.surface == Surface::Building ? object.triangle_count : 0;
  }
  EXPECT_EQ(triangles, buildings) << "every triangle of a building is in one facet";
  EXPECT_LT(set.facets().size(), triangles / 2 + triangles / 10) << "walls are at least pairs";
  EXPECT_GT(walls, set.facets().size() / 2);
}

double polygon_area(const std::vector<Vector3d>& corners, const Vector3d& normal) {
  Vector3d twice = Vector3d::Zero();
  for (std::size_t k = 0; k < corners.size(); ++k)
    twice += corners[k].cross(corners[(k + 1) % corners.size()]);
  return 0.5 * twice.dot(normal);
}

std::vector<Vector3d> convex_part(const FacetSet& set, const Facet& facet) {
  std::array<Vector3d, 4> corners;
  const std::size_t count = set.convex_part(facet, corners);
  return {corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(count)};
}

TEST(FacetSet, ConvexPartsCoverWallsOfTwoTrianglesWhole) {
  Mesh mesh;
  canyon::test::append_box(mesh, "box", Surface::Building, Material::Glass, {-10, -5, 0}, {10, 5, 30}, 0.4);
  const FacetSet set(mesh, false);
  for (const Facet& facet : set.facets()) {
    const std::vector<Vector3d> corners = convex_part(set, facet);
    ASSERT_EQ(corners.size(), 4u);
    for (const Vector3d& c : corners) {
      EXPECT_NEAR(facet.normal.dot(c), facet.offset, 1e-9);
      EXPECT_TRUE(std::any_of(mesh.vertices.begin(), mesh.vertices.end(),
                              [&c](const Vector3d& v) { return (v - c).norm() < 1e-9; }));
    }
    const double length = std::abs(facet.normal.z()) > 0.5 ? 20 * 10.0
                          : std::abs(facet.normal.dot(Vector3d(std::cos(0.4), std::sin(0.4), 0))) > 0.5
                              ? 10 * 30.0
                              : 20 * 30.0;
    EXPECT_NEAR(polygon_area(corners, facet.normal), length, 1e-9) << "anticlockwise about the normal";
  }
}

TEST(FacetSet, ConvexPartsAreConvexAndCovered) {
  // An L of four triangles, a dart (two triangles that make a concave quadrilateral) and fans at random.
  Mesh mesh;
  city::append_object(mesh, "L", Surface::Building, Material::Glass,
                      {{0, 0, 0}, {10, 0, 0}, {10, 4, 0}, {4, 4, 0}, {4, 12, 0}, {0, 12, 0}},
                      {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}});
  city::append_object(mesh, "dart", Surface::Building, Material::Glass,
                      {{0, 0, 20}, {10, 2, 20}, {4, 4, 20}, {2, 10, 20}}, {{0, 1, 2}, {0, 2, 3}});
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> radius(2, 10), unit(0, 1);
  for (int fan = 0; fan < 20; ++fan) {
    std::vector<Vector3d> vertices{{0, 50.0 + 30 * fan, 0}};
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (std::uint32_t k = 0; k < 9; ++k) {
      const double angle = 2 * EIGEN_PI * k / 9;
      vertices.push_back(vertices[0] + radius(random) * Vector3d(std::cos(angle), 0, std::sin(angle)));
      triangles.push_back({0, 1 + (k + 1) % 9, 1 + k});
    }
    city::append_object(mesh, "fan", Surface::Building, Material::Glass, vertices, triangles);
  }
  const FacetSet set(mesh, false);
  ASSERT_EQ(set.facets().size(), 22u);
  int quadrilaterals = 0;
  for (const Facet& facet : set.facets()) {
    const std::vector<Vector3d> corners = convex_part(set, facet);
    quadrilaterals += corners.size() == 4 ? 1 : 0;
    Vector3d centre = Vector3d::Zero();
    for (const Vector3d& c : corners) centre += c / static_cast<double>(corners.size());
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const Vector3d &a = corners[k], &b = corners[(k + 1) % corners.size()],
                     &c = corners[(k + 2) % corners.size()];
      EXPECT_GE((b - a).cross(c - b).dot(facet.normal), -1e-9) << "convex";
      for (int sample = 0; sample < 50; ++sample) {
        const Vector3d edge = a + unit(random) * (b - a);
        EXPECT_TRUE(set.triangle_at(facet, centre + unit(random) * (1 - 1e-9) * (edge - centre)));
      }
    }
  }
  EXPECT_GT(quadrilaterals, 10);
  EXPECT_LT(quadrilaterals, 22) << "the dart is one triangle";
}

}  // namespace
}  // namespace canyon::propagation
