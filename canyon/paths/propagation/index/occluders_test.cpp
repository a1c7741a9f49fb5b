#include "canyon/paths/propagation/index/occluders.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "tests/support/append_box.hpp"

namespace canyon::propagation {
namespace {

using city::Material;
using city::Mesh;
using city::Surface;
using Eigen::Vector3d;

struct View {
  FacingFacets facing;
  std::vector<Occluders::Hidden> regions;
  std::vector<std::uint8_t> hidden;
};

View view(const FacetSet& set, const Vector3d& antenna, std::size_t count) {
  const Occluders occluders(set);
  View v;
  Occluders::Scratch scratch;
  NearFacets near;
  set.gather(antenna, 0, 500, near);
  v.facing.fill(near, antenna, 2e-3);
  occluders.hidden_regions(set, v.facing, antenna, count, 2e-3, scratch, v.regions);
  mark_hidden(v.facing, v.regions, v.hidden);
  return v;
}

/// Whether the facet at height z of the plane x = distance, if any faces the antenna, is hidden.
bool hidden_at(const View& v, const FacetSet& set, double distance) {
  for (std::size_t i = 0; i < v.facing.facet.size(); ++i) {
    const Facet& facet = set.facets()[v.facing.facet[i]];
    if (std::abs(facet.min.x() - distance) < 1e-6 && std::abs(facet.max.x() - distance) < 1e-6) {
      return v.hidden[i] != 0;
    }
  }
  ADD_FAILURE() << "no facet at x = " << distance;
  return false;
}

// A wall at x = 10, y and z in [-5, 5], seen from the origin. It covers |y|, |z| < 15 at x = 30.
TEST(Occluders, HideWhatIsWhollyInTheShadow) {
  const auto with = [](double half, double x, bool triangle) {
    Mesh mesh;
    if (triangle) {
      city::append_object(mesh, "t", Surface::Building, Material::Glass,
                          {{10, -5, -5}, {10, 0, 5}, {10, 5, -5}}, {{0, 1, 2}});
    } else {
      city::append_object(mesh, "wall", Surface::Building, Material::Glass,
                          {{10, -5, -5}, {10, -5, 5}, {10, 5, 5}, {10, 5, -5}}, {{0, 1, 2}, {0, 2, 3}});
    }
    const double low = triangle ? -3 * half / 4 : -half;
    city::append_object(mesh, "far", Surface::Building, Material::Glass,
                        {{x, -half, low}, {x, -half, half}, {x, half, half}, {x, half, low}},
                        {{0, 1, 2}, {0, 2, 3}});
    return FacetSet(mesh, false);
  };
  const FacetSet inside = with(14.9, 30, false), outside = with(15.1, 30, false), before = with(1, 9, false);
  EXPECT_TRUE(hidden_at(view(inside, Vector3d::Zero(), 8), inside, 30));
  EXPECT_FALSE(hidden_at(view(outside, Vector3d::Zero(), 8), outside, 30));
  EXPECT_FALSE(hidden_at(view(before, Vector3d::Zero(), 8), before, 9));
  EXPECT_FALSE(hidden_at(view(inside, Vector3d::Zero(), 8), inside, 10)) << "nothing hides itself";
  EXPECT_FALSE(hidden_at(view(inside, Vector3d::Zero(), 0), inside, 30)) << "no occluders";
  // The triangle with corners (-5, -5), (0, 5), (5, -5) is half as wide at the height 0; at x = 30 the square
  // |y| <= h, z in [-3h/4, h] fits in if h <= (15 - h) / 2, h <= 5.
  const FacetSet fits = with(4.9, 30, true), does_not = with(5.1, 30, true);
  EXPECT_TRUE(hidden_at(view(fits, Vector3d::Zero(), 8), fits, 30));
  EXPECT_FALSE(hidden_at(view(does_not, Vector3d::Zero(), 8), does_not, 30));
  // Spheres: one of radius 1 at (30, y, 0) is inside to y = 15 - sqrt(1.25) = 13.88 (the sides' slope is 1 :
  // 2).
  const View v = view(inside, Vector3d::Zero(), 8);
  EXPECT_TRUE(is_hidden({30, 13.8, 0}, 1, v.regions));
  EXPECT_FALSE(is_hidden({30, 13.95, 0}, 1, v.regions));
  EXPECT_TRUE(is_hidden({11.1, 0, 0}, 1, v.regions));
  EXPECT_FALSE(is_hidden({10.9, 0, 0}, 1, v.regions));
}

// The first surface that a ray meets is never hidden.
TEST(Occluders, NeverHideWhatARayMeets) {
  std::mt19937_64 random(71);
  std::uniform_real_distribution<double> at(-70, 70), size(5, 30), height(5, 60), yaw(0, 3.1), unit(-1, 1);
  Mesh mesh;
  for (int i = 0; i < 40; ++i) {
    const Vector3d corner(at(random), at(random), 0);
    canyon::test::append_box(mesh, "box", Surface::Building, Material::Glass, corner,
                             corner + Vector3d(size(random), size(random), height(random)), yaw(random));
  }
  const raytrace::RayScene scene(mesh);
  const FacetSet set(mesh, false);
  std::size_t hidden = 0, facing = 0, met = 0;
  for (int index = 0; index < 50; ++index) {
    const Vector3d antenna(at(random), at(random), 2);
    if (scene.containment(antenna) != raytrace::Containment::Free) continue;
    const View v = view(set, antenna, 32);
    facing += v.facing.facet.size();
    hidden += static_cast<std::size_t>(std::count(
        v.hidden.begin(), v.hidden.begin() + static_cast<std::ptrdiff_t>(v.facing.facet.size()), 1));
    for (int ray = 0; ray < 2'000; ++ray) {
      const Vector3d d = Vector3d(unit(random), unit(random), 0.5 * (unit(random) + 1)).normalized();
      const auto hit = scene.cast({antenna, d}, 2e-3);
      if (!hit) continue;
      ++met;
      const Vector3d point = antenna + hit->range_m * d;
      for (std::size_t i = 0; i < v.facing.facet.size(); ++i) {
        if (v.hidden[i] == 0) continue;
        const Facet& facet = set.facets()[v.facing.facet[i]];
        if (std::abs(facet.normal.dot(point) - facet.offset) > 1e-4) continue;
        EXPECT_FALSE(set.triangle_at(facet, point) == hit->triangle) << antenna.transpose();
      }
    }
  }
  EXPECT_GT(met, 20'000u);
  EXPECT_GT(hidden, facing / 4) << "of " << facing;
}

}  // namespace
}  // namespace canyon::propagation
