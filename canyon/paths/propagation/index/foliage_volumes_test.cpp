// Lengths inside boxes, which have a closed form, and shapes that are no volumes.

#include "canyon/paths/propagation/index/foliage_volumes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "canyon/city/city.hpp"
#include "tests/support/append_box.hpp"

namespace canyon::propagation {
namespace {

using city::Material;
using city::Mesh;
using city::Surface;
using Eigen::Vector3d;

Mesh boxes(const std::vector<std::pair<Vector3d, Vector3d>>& bounds, Surface surface = Surface::Foliage) {
  Mesh mesh;
  for (const auto& [min, max] : bounds)
    canyon::test::append_box(mesh, "box", surface, Material::Foliage, min, max);
  return mesh;
}

double depth(const FoliageVolumes& volumes, const Vector3d& origin, const Vector3d& direction) {
  std::vector<RangeInterval> inside;
  volumes.append_inside(origin, direction.normalized(), inside);
  return covered_length_m(inside);
}
double depth(const Mesh& mesh, const Vector3d& origin, const Vector3d& direction) {
  return depth(FoliageVolumes(mesh), origin, direction);
}

TEST(FoliageVolumes, CoveredLengthCountsOverlapsOnce) {
  std::vector<RangeInterval> none;
  EXPECT_EQ(covered_length_m(none), 0);
  std::vector<RangeInterval> some{{10, 12}, {0, 5}, {4, 7}, {1, 2}, {12, 13}, {30, 30}};
  EXPECT_DOUBLE_EQ(covered_length_m(some), 7 + 3);
}

TEST(FoliageVolumes, ABoxIsAsDeepAsTheRayIsLongInIt) {
  const Mesh mesh = boxes({{{-50, 20, 0}, {50, 30, 50}}});
  EXPECT_NEAR(depth(mesh, {0, 0, 2}, {0, 1, 0}), 10, 1e-12);
  EXPECT_NEAR(depth(mesh, {0.3, 0, 2}, {0, 1, 1}), 10 * std::sqrt(2), 1e-12);
  EXPECT_NEAR(depth(mesh, {0.3, 0, 2}, {1, 2, 0}), 5 * std::sqrt(5), 1e-12);
  EXPECT_EQ(depth(mesh, {0, 0, 2}, {0, -1, 0}), 0) << "behind";
  EXPECT_EQ(depth(mesh, {0, 0, 60}, {0, 1, 0}), 0) << "below";
  EXPECT_NEAR(depth(mesh, {0, 23, 2}, {0, 1, 0}), 7, 1e-12) << "from inside";
  EXPECT_TRUE(FoliageVolumes(boxes({{{0, 0, 0}, {1, 1, 1}}}, Surface::Building)).empty());
}

TEST(FoliageVolumes, NestedAndTouchingVolumesCountOnce) {
  // Along y: [20, 50] with [25, 30] and [35, 40] inside.
  EXPECT_NEAR(depth(boxes({{{-9, 20, 0}, {9, 50, 9}}, {{-5, 25, 1}, {5, 30, 5}}, {{-5, 35, 1}, {5, 40, 5}}}),
                    {0.1, 0, 2}, {0, 1, 0}),
              30, 1e-12);
  // A row without gaps, then a gap.
  EXPECT_NEAR(depth(boxes({{{-9, 20, 0}, {9, 30, 9}},
                           {{-9, 30, 0}, {9, 40, 9}},
                           {{-9, 40, 0}, {9, 45, 9}},
                           {{-9, 60, 0}, {9, 62, 9}}}),
                    {0.1, 0, 2}, {0, 1, 0}),
              27, 1e-12);
  EXPECT_NEAR(depth(boxes({{{-9, 20, 0}, {9, 30, 9}}, {{-9, 20, 0}, {9, 30, 9}}}), {0.1, 0, 2}, {0, 1, 0}),
              10, 1e-12)
      << "drawn twice";
}

// Rays through corners, edges and diagonals: two or more triangles at one point.
TEST(FoliageVolumes, EdgesCountOnce) {
  const FoliageVolumes box(boxes({{{-10, 20, 0}, {10, 30, 20}}}));
  EXPECT_NEAR(depth(box, {0, 0, 10}, {0, 1, 0}), 10, 1e-9) << "the middle of both diagonals";
  EXPECT_NEAR(depth(box, {0, 25, 10}, {0, 1, 0}), 5, 1e-9) << "from inside through a diagonal";
  EXPECT_NEAR(depth(box, {-20, 10, -10}, {1, 1, 1}), 10 * std::sqrt(3), 1e-5) << "in at a corner";
  EXPECT_NEAR(depth(box, {-15, 15, 10}, {1, 1, 0}), 10 * std::sqrt(2), 1e-5) << "in at a vertical edge";
  EXPECT_LT(depth(box, {-15, 25, 10}, {1, -1, 0}), 1e-5) << "touches that edge from outside";
}

TEST(FoliageVolumes, FrontsMayLookInwards) {
  Mesh mesh = boxes({{{-10, 20, 0}, {10, 30, 20}}});
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  EXPECT_NEAR(depth(mesh, {0.1, 0, 2}, {0, 1, 0}), 10, 1e-12);
  EXPECT_NEAR(depth(mesh, {0.1, 22, 2}, {0, 1, 0}), 8, 1e-12);
}

TEST(FoliageVolumes, SheetsHaveNoDepth) {
  Mesh card;
  city::append_object(card, "card", Surface::Foliage, Material::Foliage,
                      {{-5, 20, 0}, {5, 20, 0}, {5, 20, 9}, {-5, 20, 9}}, {{0, 1, 2}, {0, 2, 3}});
  EXPECT_FALSE(FoliageVolumes(card).empty());
  EXPECT_EQ(depth(card, {0.1, 0, 2}, {0, 1, 0}), 0) << "from the front";
  EXPECT_EQ(depth(card, {0.1, 40, 2}, {0, -1, 0}), 0) << "from the back";
  // A crown without a floor: level rays pass it from front to back; one from below only leaves it.
  Mesh crown = boxes({{{-10, 20, 3}, {10, 30, 20}}});
  crown.triangles.erase(std::remove_if(crown.triangles.begin(), crown.triangles.end(),
                                       [&](const auto& t) {
                                         return std::all_of(t.begin(), t.end(), [&](auto v) {
                                           return crown.vertices[v].z() == 3;
                                         });
                                       }),
                        crown.triangles.end());
  ASSERT_EQ(crown.triangles.size(), 10u);
  crown.materials.resize(10);
  crown.objects[0].triangle_count = 10;
  EXPECT_NEAR(depth(crown, {0.1, 0, 7}, {0, 1, 0}), 10, 1e-12);
  EXPECT_EQ(depth(crown, {0.1, 25, 1}, {0, 0, 1}), 0);
}

// The union of many boxes along random rays, box by box by the slab method.
TEST(FoliageVolumes, RandomBoxesHaveTheClosedForm) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> at(-40, 40), size(2, 25), along(-1, 1);
  double deepest = 0;
  for (int scene = 0; scene < 20; ++scene) {
    std::vector<std::pair<Vector3d, Vector3d>> bounds;
    for (int i = 0; i < 40; ++i) {
      const Vector3d min(at(random), at(random), at(random));
      bounds.emplace_back(min, min + Vector3d(size(random), size(random), size(random)));
    }
    const FoliageVolumes volumes(boxes(bounds));
    for (int i = 0; i < 500; ++i) {
      const Vector3d origin(at(random), at(random), at(random));
      const Vector3d direction = Vector3d(along(random), along(random), along(random)).normalized();
      std::vector<RangeInterval> inside;
      for (const auto& [min, max] : bounds) {
        const Vector3d a = (min - origin).cwiseQuotient(direction),
                       b = (max - origin).cwiseQuotient(direction);
        const double from = std::max(0.0, a.cwiseMin(b).maxCoeff()), to = a.cwiseMax(b).minCoeff();
        if (to > from) inside.push_back({from, to});
      }
      const double expected = covered_length_m(inside);
      EXPECT_NEAR(depth(volumes, origin, direction), expected, 1e-6);
      deepest = std::max(deepest, expected);
    }
  }
  EXPECT_GT(deepest, 60);
}

}  // namespace
}  // namespace canyon::propagation
