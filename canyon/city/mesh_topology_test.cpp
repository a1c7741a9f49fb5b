#include "canyon/city/mesh_topology.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>
#include <utility>

#include "canyon/city/city.hpp"
#include "tests/support/append_box.hpp"

namespace canyon::city {
namespace {

struct Solid {
  std::vector<Eigen::Vector3d> vertices;
  TriangleIndices triangles;

  void add_box(const Eigen::Vector3d& min, const Eigen::Vector3d& max, bool floor = true) {
    Mesh mesh;
    canyon::test::append_box(mesh, "box", Surface::Building, Material::Unknown, min, max);
    const auto first = static_cast<std::uint32_t>(vertices.size());
    vertices.insert(vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    for (const auto& t : mesh.triangles) {
      const bool is_floor = mesh.vertices[t[0]].z() == min.z() && mesh.vertices[t[1]].z() == min.z() &&
                            mesh.vertices[t[2]].z() == min.z();
      if (floor || !is_floor) triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
  }
};

TEST(IsDegenerate, ByArea) {
  const Eigen::Vector3d o = Eigen::Vector3d::Zero();
  EXPECT_FALSE(is_degenerate(o, {1, 0, 0}, {0, 1, 0}));
  EXPECT_TRUE(is_degenerate(o, {1, 0, 0}, {2, 0, 0}));
  EXPECT_TRUE(is_degenerate(o, o, {2, 0, 0}));
  EXPECT_FALSE(is_degenerate(o, {1, 0, 0}, {0, 2.1e-8, 0}));  // 1.05e-8 m^2
  EXPECT_TRUE(is_degenerate(o, {1, 0, 0}, {0, 1.9e-8, 0}));
  EXPECT_TRUE(is_degenerate(o, {1, 0, 0}, {0, std::numeric_limits<double>::quiet_NaN(), 0}));
}

TEST(Weld, ByExactPosition) {
  const std::vector<Eigen::Vector3d> vertices{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-0.0, 0, 0}, {1, 1e-12, 0}};
  TriangleIndices triangles{{0, 1, 2}, {3, 4, 2}};
  weld(vertices, triangles);
  EXPECT_EQ(triangles, (TriangleIndices{{0, 1, 2}, {0, 4, 2}}));
}

TEST(ConnectedComponents, InOrderOfFirstTriangle) {
  const TriangleIndices triangles{{0, 1, 2}, {5, 6, 7}, {2, 3, 4}, {7, 8, 9}, {10, 11, 12}};
  const auto components = connected_components(triangles, 13);
  ASSERT_EQ(components.size(), 3U);
  EXPECT_EQ(components[0], (std::vector<std::uint32_t>{0, 2}));
  EXPECT_EQ(components[1], (std::vector<std::uint32_t>{1, 3}));
  EXPECT_EQ(components[2], (std::vector<std::uint32_t>{4}));
}

TEST(OrientOutwards, LeavesGoodOnesAlone) {
  for (const bool floor : {true, false}) {
    Solid solid;
    solid.add_box({5, 5, 2}, {7, 8, 6}, floor);
    const TriangleIndices before = solid.triangles;
    const OrientedSolids result = orient_outwards(solid.vertices, solid.triangles);
    EXPECT_EQ(solid.triangles, before);
    EXPECT_TRUE(result.closed);
    EXPECT_TRUE(result.manifold);
    EXPECT_TRUE(result.orientable);
    EXPECT_EQ(result.flipped_count, 0U);
    EXPECT_NEAR(result.volume_m3, 2 * 3 * 4, 1e-12);
  }
}

TEST(OrientOutwards, TurnsAnyMixture) {
  for (const bool floor : {true, false}) {
    Solid solid;
    solid.add_box({5, 5, 2}, {7, 8, 6}, floor);
    const TriangleIndices good = solid.triangles;
    // All patterns of wrong triangles among the first ten; every other one right.
    for (unsigned pattern = 0; pattern < 1024; ++pattern) {
      solid.triangles = good;
      for (unsigned t = 0; t < 10; ++t) {
        if ((pattern >> t & 1U) != 0) std::swap(solid.triangles[t][1], solid.triangles[t][2]);
      }
      const OrientedSolids result = orient_outwards(solid.vertices, solid.triangles);
      EXPECT_TRUE(result.closed) << pattern;
      EXPECT_NEAR(result.volume_m3, 24, 1e-12) << pattern;
      ASSERT_EQ(solid.triangles.size(), good.size());
    }
  }
}

// A tower and its podium, both down to the ground without floors, share base edges in the same direction,
// which is valid.
TEST(OrientOutwards, PodiumAndTowerOnOneOutline) {
  Solid solid;
  solid.add_box({0, 0, 0}, {40, 30, 10}, false);
  solid.add_box({0, 0, 0}, {40, 20, 90}, false);
  weld(solid.vertices, solid.triangles);
  ASSERT_EQ(connected_components(solid.triangles, solid.vertices.size()).size(), 1U);
  const TriangleIndices before = solid.triangles;
  const OrientedSolids result = orient_outwards(solid.vertices, solid.triangles);
  EXPECT_EQ(result.flipped_count, 0U);
  EXPECT_EQ(solid.triangles, before);
  EXPECT_TRUE(result.closed);
  // If only one of the two is inside out, only that one is flipped.
  for (std::size_t t = 10; t < 20; ++t) std::swap(solid.triangles[t][1], solid.triangles[t][2]);
  EXPECT_EQ(orient_outwards(solid.vertices, solid.triangles).flipped_count, 10U);
  EXPECT_EQ(solid.triangles, before);
}

TEST(OrientOutwards, OpenSheetsKeepTheirMajority) {
  const std::vector<Eigen::Vector3d> vertices{{0, 0, 0}, {1, 0, 3}, {1, 1, 0}, {0, 1, 3}, {2, 0, 1}};
  TriangleIndices triangles{{0, 1, 2}, {0, 2, 3}, {1, 2, 4}};
  const OrientedSolids result = orient_outwards(vertices, triangles);
  EXPECT_FALSE(result.closed);
  EXPECT_EQ(result.flipped_count, 1U);
  EXPECT_EQ(triangles, (TriangleIndices{{0, 1, 2}, {0, 2, 3}, {1, 4, 2}}));
}

TEST(OrientOutwards, MoebiusStripIsLeftAlone) {
  // Five triangles in a ring with one twist: i, i+1, i+2 modulo 5.
  const std::vector<Eigen::Vector3d> vertices{
      {2, 0, 0.1}, {0.6, 1.9, 0.7}, {-1.6, 1.1, 0}, {-1.6, -1.1, 1}, {0.6, -1.9, 0.3}};
  TriangleIndices triangles{{0, 1, 2}, {1, 2, 3}, {2, 3, 4}, {3, 4, 0}, {4, 0, 1}};
  const TriangleIndices before = triangles;
  const OrientedSolids result = orient_outwards(vertices, triangles);
  EXPECT_FALSE(result.orientable);
  EXPECT_EQ(triangles, before);
}

}  // namespace
}  // namespace canyon::city
