#include "canyon/paths/propagation/index/facade_light.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "tests/support/append_box.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Vector3d;

Vector3d towards(double azimuth_deg, double elevation_deg) {
  return geodesy::enu_from_azimuth_elevation(geodesy::radians(azimuth_deg), geodesy::radians(elevation_deg));
}

/// A house with its east wall at x = 0, and a long block of 30 m at x = 20.
city::Mesh street() {
  city::Mesh mesh;
  canyon::test::append_box(mesh, "house", city::Surface::Building, city::Material::Concrete, {-10, -20, 0},
                           {0, 20, 24});
  canyon::test::append_box(mesh, "block", city::Surface::Building, city::Material::Concrete, {20, -5000, 0},
                           {30, 5000, 30});
  return mesh;
}

std::uint32_t triangle_at(const raytrace::RayScene& scene, const Vector3d& from, const Vector3d& direction) {
  return scene.cast({from, direction}).value().triangle;
}

TEST(FacadeLight, DirectionsAreADegreeApart) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> azimuth(0, 360), height(-1, 1);
  std::vector<std::pair<std::uint32_t, Vector3d>> middles;
  for (int i = 0; i < 20'000; ++i) {
    const Vector3d s = towards(azimuth(random), geodesy::degrees(std::asin(height(random))));
    const FacadeLight::Direction d = FacadeLight::direction(s);
    EXPECT_NEAR(d.middle.norm(), 1, 1e-12);
    EXPECT_LT(geodesy::degrees(std::acos(std::min(1.0, d.middle.dot(s)))), 0.75);
    EXPECT_EQ(FacadeLight::direction(d.middle).number, d.number);
    middles.emplace_back(d.number, d.middle);
  }
  std::sort(middles.begin(), middles.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t i = 1; i < middles.size(); ++i) {
    EXPECT_EQ(middles[i].first == middles[i - 1].first, middles[i].second == middles[i - 1].second);
  }
  for (const Vector3d& pole : {Vector3d(0, 0, 1), Vector3d(0, 0, -1)})
    EXPECT_GT(FacadeLight::direction(pole).middle.dot(pole), 0.9999);
}

// The cell's middle is at most half a cell from the point, which is the accuracy of the shadow's edge.
TEST(FacadeLight, CellsSeeOverABlockFromWhereTheyStand) {
  const raytrace::RayScene scene(street());
  const FacadeLight light(scene);
  int lit = 0, dark = 0;
  for (double z = 0.5; z < 24; z += 1) {
    const Vector3d point(0, 3.3, z);
    const std::uint32_t triangle = triangle_at(scene, {10, 3.3, z}, {-1, 0, 0});
    for (double elevation = 2; elevation < 80; elevation += 1.7) {
      FacadeLight::Cell cell = light.cell(triangle, point, true);
      const FacadeLight::Direction direction = FacadeLight::direction(towards(90, elevation));
      const double rise = 20 / direction.middle.x() * direction.middle.z();
      const double over = z + rise - 30;
      if (std::abs(over) < FacadeLight::kCell_m) continue;
      EXPECT_EQ(light.sees(cell, direction), over > 0) << z << ' ' << elevation;
      (over > 0 ? lit : dark) += 1;
    }
  }
  EXPECT_GT(lit, 100);
  EXPECT_GT(dark, 100);
}

TEST(FacadeLight, TheOtherSideOfAWallLooksTheOtherWay) {
  const raytrace::RayScene scene(street());
  const FacadeLight light(scene);
  const std::uint32_t triangle = triangle_at(scene, {10, 3, 12}, {-1, 0, 0});
  const FacadeLight::Direction east = FacadeLight::direction(towards(90, 80));
  FacadeLight::Cell outside = light.cell(triangle, {0, 3, 12}, true);
  FacadeLight::Cell inside = light.cell(triangle, {0, 3, 12}, false);
  EXPECT_TRUE(light.sees(outside, east));
  EXPECT_FALSE(light.sees(inside, east));  // it is in the house
  EXPECT_LT(inside.middle.x(), 0);
  EXPECT_GT(FacadeLight(scene).cell(triangle, {0, 3, 12}, true).number, 0u);
}

/// Results for many cells and directions in a fixed order; the order of the requests depends on the seed.
std::vector<bool> answers(const FacadeLight& light, const raytrace::RayScene& scene, unsigned seed) {
  std::vector<std::pair<FacadeLight::Cell, FacadeLight::Direction>> keys;
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> azimuth(0, 360), elevation(5, 85), coordinate(-150, 150),
      height(1, 20);
  while (keys.size() < 4'000) {
    const Vector3d from(coordinate(random), coordinate(random), height(random));
    const Vector3d ray = towards(azimuth(random), 5);
    const auto hit = scene.cast({from, ray, 300});
    if (!hit) continue;
    const FacadeLight::Cell cell = light.cell(hit->triangle, from + hit->range_m * ray, hit->front);
    for (int i = 0; i < 8; ++i)
      keys.emplace_back(cell, FacadeLight::direction(towards(azimuth(random), elevation(random))));
  }
  std::vector<std::size_t> order(keys.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), std::mt19937_64(seed));
  std::vector<bool> result(keys.size());
  for (const std::size_t i : order) result[i] = light.sees(keys[i].first, keys[i].second);
  return result;
}

TEST(FacadeLight, AnswersDoNotDependOnWhoAskedFirst) {
  const raytrace::RayScene scene(city::synthetic_city({}).mesh);
  const FacadeLight one(scene), other(scene);
  const std::vector<bool> expected = answers(one, scene, 1);
  EXPECT_GT(std::count(expected.begin(), expected.end(), true), 500);
  EXPECT_GT(std::count(expected.begin(), expected.end(), false), 500);
  EXPECT_EQ(answers(one, scene, 2), expected);
  std::vector<std::vector<bool>> found(4);
  std::vector<std::thread> threads;
  for (unsigned i = 0; i < found.size(); ++i)
    threads.emplace_back([&, i] { found[i] = answers(other, scene, 3 + i); });
  for (std::thread& thread : threads) thread.join();
  for (const std::vector<bool>& each : found) EXPECT_EQ(each, expected);
}

// A few triangles have a table of 32 KB, 4,096 rows of 8 cells: most of the 32,000 keys are evicted.
TEST(FacadeLight, ForgetsWithoutChangingItsAnswers) {
  const raytrace::RayScene scene(street());
  const FacadeLight light(scene, 200);
  EXPECT_EQ(light.table_bytes(), std::size_t{32} << 10);
  EXPECT_EQ(answers(light, scene, 1), answers(FacadeLight(scene, 200), scene, 2));
}

TEST(FacadeLight, HasATableOfBoundedSize) {
  city::Mesh large;
  canyon::test::append_box(large, "wall", city::Surface::Building, city::Material::Concrete, {-1e4, -1e4, 0},
                           {1e4, 1e4, 500});
  EXPECT_EQ(FacadeLight(raytrace::RayScene(large)).table_bytes(), FacadeLight::kMaxBytes);
  EXPECT_LE(FacadeLight(raytrace::RayScene(large), 1e-3).table_bytes(), FacadeLight::kMaxBytes);
  EXPECT_EQ(FacadeLight(raytrace::RayScene(city::Mesh{})).table_bytes(), std::size_t{32} << 10);
}

}  // namespace
}  // namespace canyon::propagation
