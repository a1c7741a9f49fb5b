// A propagator that traces many epochs allocates nothing once its buffers have grown.

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/count_allocations.hpp"

#ifdef CANYON_COUNTS_ALLOCATIONS

namespace canyon::propagation {
namespace {

using test::allocations;

TEST(Propagator, AllocatesNothingInTheSteadyState) {
  city::City city = city::synthetic_city({});
  canyon::test::append_box(city.mesh, "hedge", city::Surface::Foliage, city::Material::Foliage, {-50, -3, 0},
                           {50, -2, 4});
  raytrace::RayScene scene(city.mesh);
  city::Mesh bus;
  canyon::test::append_box(bus, "bus", city::Surface::Vehicle, city::Material::Metal, {-6, -1, 0}, {6, 1, 4});
  scene.set_pose(scene.add_instance(bus), Eigen::Isometry3d(Eigen::Translation3d(10, 4, 0)));
  scene.commit();
  std::vector<Eigen::Vector3d> sky;
  sky.reserve(50);
  for (int i = 0; i < 50; ++i) sky.push_back(geodesy::enu_from_azimuth_elevation(0.7 * i, 0.1 + 0.028 * i));
  for (const Model model : {Model::Specular, Model::Mirror}) {
    PropagationOptions options;
    options.model = model;
    options.reflection_order = 2;
    options.diffraction = options.diffuse = options.through_foliage = true;
    const Propagator propagator(city.mesh, scene, options);
    std::vector<SatellitePaths> result(sky.size());
    std::size_t paths = 0;
    const auto drive = [&] {
      for (double rotation = -200; rotation < 200; rotation += 1) {  // there and back
        propagator.trace({std::abs(rotation) - 100, 0.3, 2}, sky, result);
        for (const SatellitePaths& satellite : result) paths += satellite.paths.size();
      }
    };
    drive();
    const long before = allocations;
    drive();
    EXPECT_EQ(allocations - before, 0);
    EXPECT_GT(paths, 1'000u);
  }
}

}  // namespace
}  // namespace canyon::propagation

#endif
