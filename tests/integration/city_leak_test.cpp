// No ray leaks out of the solids of a real map: from inside a building every direction hits a surface.

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <iostream>
#include <random>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/loaded_city.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon {
namespace {

TEST(CityLeak, NoRayLeavesABuildingOfTheMoscowExtract) {
  CANYON_SHARED_DATA(path, "osm/moscow.osm.gz");
  simulation::CityConfig config;
  config.source.emplace<simulation::MapCity>().files = {path};
  const city::City city = test::loaded_city(config);
  const raytrace::RayScene scene(city.mesh);

  std::mt19937 random(1);  // its sequence is the standard's
  std::size_t rays = 0;
  std::size_t leaks = 0;
  std::size_t buildings = 0;
  for (const city::Object& object : city.mesh.objects) {
    if (object.surface != city::Surface::Building) continue;
    ++buildings;
    // 0.1 m below the centre of each roof triangle that is large enough for a distance to its edges.
    for (std::uint32_t k = 0; k < object.triangle_count; ++k) {
      const auto& corners = city.mesh.triangles[object.first_triangle + k];
      const Eigen::Vector3d& a = city.mesh.vertices[corners[0]];
      const Eigen::Vector3d& b = city.mesh.vertices[corners[1]];
      const Eigen::Vector3d& c = city.mesh.vertices[corners[2]];
      const Eigen::Vector3d normal = (b - a).cross(c - a);
      if (normal.z() < 0.9 * normal.norm() || normal.norm() < 2) continue;
      const Eigen::Vector3d inside = (a + b + c) / 3 - Eigen::Vector3d(0, 0, 0.05);
      for (int i = 0; i < 16; ++i) {
        const double z = 2.0 * random() / 4294967296.0 - 1;
        const double angle = 2 * geodesy::kPi * random() / 4294967296.0;
        const double level = std::sqrt(1 - z * z);
        ++rays;
        if (!scene.occluded({inside, {level * std::cos(angle), level * std::sin(angle), z}})) ++leaks;
      }
    }
  }
  std::cout << buildings << " buildings, " << rays << " rays from inside, " << leaks << " leaks\n";
  EXPECT_EQ(buildings, 670U);
  EXPECT_GT(rays, 10'000U);
  EXPECT_EQ(leaks, 0U);
}

}  // namespace
}  // namespace canyon
