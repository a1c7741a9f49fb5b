#include "canyon/heatmap/kernels/shadow_solids.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <utility>
#include <vector>

#include "canyon/city/mesh_file.hpp"
#include "canyon/city/primitive_meshes.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::heatmap {
namespace {

using city::Mesh;
using city::TriangleSet;
using Eigen::Vector3d;

Mesh mesh_of(const TriangleSet& set) {
  Mesh mesh;
  city::append_object(mesh, "part", city::Surface::Building, city::Material::Concrete, set.vertices,
                      set.triangles);
  return mesh;
}

TriangleSet moved(TriangleSet set, const Vector3d& by) {
  for (Vector3d& v : set.vertices) v += by;
  return set;
}

TriangleSet joined(TriangleSet a, const TriangleSet& b) {
  const auto offset = static_cast<std::uint32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const auto& t : b.triangles) a.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  return a;
}

TriangleSet inside_out(TriangleSet set) {
  for (auto& t : set.triangles) std::swap(t[1], t[2]);
  return set;
}

TriangleSet without_floor(TriangleSet set) {
  double lowest = 1e300;
  for (const Vector3d& v : set.vertices) lowest = std::min(lowest, v.z());
  set.triangles.erase(std::remove_if(set.triangles.begin(), set.triangles.end(),
                                     [&](const auto& t) {
                                       return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) {
                                         return set.vertices[v].z() == lowest;
                                       });
                                     }),
                      set.triangles.end());
  return set;
}

bool all_solid(const Solids& found) {
  return std::none_of(found.of_triangle.begin(), found.of_triangle.end(),
                      [](std::uint32_t s) { return s == Solids::kNone; });
}

bool none_solid(const Solids& found) {
  return found.solids.empty() && std::all_of(found.of_triangle.begin(), found.of_triangle.end(),
                                             [](std::uint32_t s) { return s == Solids::kNone; });
}

TEST(ShadowSolids, ClosedBodiesAreSolids) {
  for (const TriangleSet& set :
       {city::box_mesh({4, 5, 6}), city::cylinder_mesh(3, 8, 32), city::sphere_mesh(5, 24)}) {
    const Solids found = find_solids(mesh_of(set));
    EXPECT_TRUE(all_solid(found));
    ASSERT_EQ(found.solids.size(), 1u);
    EXPECT_FALSE(found.solids[0].floorless);
  }
  const Solids box = find_solids(mesh_of(moved(city::box_mesh({4, 6, 8}), {10, 20, 30})));
  EXPECT_EQ(box.solids[0].bounds.min, Vector3d(8, 17, 26));
  EXPECT_EQ(box.solids[0].bounds.max, Vector3d(12, 23, 34));
}

TEST(ShadowSolids, NothingIsNone) {
  EXPECT_TRUE(find_solids(Mesh{}).solids.empty());
}

TEST(ShadowSolids, AFloorMayBeMissing) {
  const Solids found = find_solids(mesh_of(without_floor(city::box_mesh({4, 5, 6}))));
  EXPECT_TRUE(all_solid(found));
  ASSERT_EQ(found.solids.size(), 1u);
  EXPECT_TRUE(found.solids[0].floorless);
}

TEST(ShadowSolids, AnotherSideMayNot) {
  TriangleSet set = city::box_mesh({4, 5, 6});
  for (std::size_t i = 0; i < set.triangles.size(); ++i) {
    TriangleSet open = set;
    open.triangles.erase(open.triangles.begin() + static_cast<std::ptrdiff_t>(i));
    const auto& t = set.triangles[i];
    const bool floor =
        std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return set.vertices[v].z() == -3; });
    EXPECT_EQ(all_solid(find_solids(mesh_of(open))), floor) << i;
  }
  // One triangle of the roof turned over; of a floor it would do no harm.
  const auto roof = std::find_if(set.triangles.begin(), set.triangles.end(), [&](const auto& t) {
    return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return set.vertices[v].z() == 3; });
  });
  ASSERT_NE(roof, set.triangles.end());
  std::swap((*roof)[1], (*roof)[2]);
  EXPECT_TRUE(none_solid(find_solids(mesh_of(set))));
}

TEST(ShadowSolids, BodiesInsideOutAreNone) {
  EXPECT_TRUE(none_solid(find_solids(mesh_of(inside_out(city::box_mesh({4, 5, 6}))))));
  EXPECT_TRUE(none_solid(find_solids(mesh_of(inside_out(city::sphere_mesh(4, 16))))));
}

// Two boxes that share an edge, one of them inside out: closed, and together of positive volume.
TEST(ShadowSolids, APartThatIsInsideOutSpoilsItsComponent) {
  const TriangleSet large = city::box_mesh({8, 8, 8});
  const TriangleSet small = moved(city::box_mesh({2, 2, 8}), {5, 5, 0});
  const Solids good = find_solids(mesh_of(joined(large, small)));
  EXPECT_TRUE(all_solid(good));
  EXPECT_EQ(good.solids.size(), 1u) << "they share vertices";
  EXPECT_TRUE(none_solid(find_solids(mesh_of(joined(large, inside_out(small))))));
}

// A prism over a bow-tie: closed, but one half is inside out and its walls cross.
TEST(ShadowSolids, PartsThatCrossThemselvesAreNone) {
  const TriangleSet tie{{{0, 0, 0},
                         {6, 4, 0},
                         {6, 0, 0},
                         {0, 4, 0},  // crosses the first side
                         {0, 0, 5},
                         {6, 4, 5},
                         {6, 0, 5},
                         {0, 4, 5}},
                        {{0, 1, 5},
                         {0, 5, 4},
                         {1, 2, 6},
                         {1, 6, 5},
                         {2, 3, 7},
                         {2, 7, 6},
                         {3, 0, 4},
                         {3, 4, 7},
                         {4, 5, 6},
                         {4, 6, 7},
                         {0, 2, 1},
                         {0, 3, 2}}};
  EXPECT_TRUE(none_solid(find_solids(mesh_of(tie))));
}

// Separate bodies may stand within one another.
TEST(ShadowSolids, BodiesThatOverlapAreSolidsEach) {
  const Solids found = find_solids(
      mesh_of(joined(city::box_mesh({4, 5, 6}), moved(city::box_mesh({4, 5, 6}), {1.3, 0.7, 0.4}))));
  EXPECT_TRUE(all_solid(found));
  EXPECT_EQ(found.solids.size(), 2u);
}

TEST(ShadowSolids, MostOfHongKong) {
  CANYON_SHARED_DATA(file, "hongkong/buildings.dae");
  const city::City city = city::read_mesh_city(file, {});
  const Solids found = find_solids(city.mesh);
  const auto solid =
      found.of_triangle.size() -
      static_cast<std::size_t>(std::count(found.of_triangle.begin(), found.of_triangle.end(), Solids::kNone));
  std::cout << found.solids.size() << " solids, " << solid << " of " << found.of_triangle.size()
            << " triangles\n";
  EXPECT_GT(solid, found.of_triangle.size() / 2);
}

}  // namespace
}  // namespace canyon::heatmap
