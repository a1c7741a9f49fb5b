// A thread that traces epoch after epoch allocates nothing once its buffers have grown.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <vector>

#include "canyon/city/synthetic_city.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/propagation/propagator.hpp"

// Sanitizers bring their own operator new.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

namespace {
std::atomic<long> allocations{0};
}

// GCC cannot see that new and delete below match.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
#endif

void* operator new(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept {
  std::free(p);
}
void operator delete(void* p, std::size_t) noexcept {
  std::free(p);
}

namespace canyon::propagation {
namespace {

TEST(Propagator, AllocatesNothingInTheSteadyState) {
  const city::City city = city::synthetic_city({});
  raytrace::RayScene scene(city.mesh);
  city::Mesh bus;
  city::append_box(bus, "bus", city::Surface::Vehicle, city::Material::Metal, {-6, -1, 0}, {6, 1, 4});
  scene.set_pose(scene.add_instance(bus), Eigen::Isometry3d(Eigen::Translation3d(10, 4, 0)));
  scene.commit();
  std::vector<Eigen::Vector3d> sky;
  for (int i = 0; i < 50; ++i) sky.push_back(geodesy::enu_from_azimuth_elevation(0.7 * i, 0.1 + 0.028 * i));
  for (const Model model : {Model::Specular, Model::Mirror}) {
    PropagationOptions options;
    options.model = model;
    options.reflection_order = 2;
    const Propagator propagator(city.mesh, scene, options);
    std::vector<SatellitePaths> result(sky.size());
    std::size_t paths = 0;
    const auto drive = [&] {
      for (double along = -100; along < 100; along += 1) {
        propagator.trace({along, 0.3, 2}, sky, result);
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
