#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/propagation/propagator.hpp"

namespace canyon::propagation {
namespace {

bool is_near(const Path& path) {
  return path.kind != PathKind::Diffuse && path.order < 2;
}

// With the edges of the place itself, Propagator::trace() without what the other leaves out: the same
// numbers.
TEST(Propagator, TraceNearGivesWhatTraceFinds) {
  city::City city = city::synthetic_city({});
  city::append_box(city.mesh, "hedge", city::Surface::Foliage, city::Material::Foliage, {-50, -3, 0},
                   {50, -2, 4});
  const raytrace::RayScene scene(city.mesh);
  PropagationOptions options;
  options.reflection_order = 2;
  options.ground_reflection = options.diffraction = options.diffuse = options.through_foliage = true;
  const Propagator propagator(city.mesh, scene, options);
  std::vector<Eigen::Vector3d> sky;
  for (int i = 0; i < 30; ++i) sky.push_back(geodesy::enu_from_azimuth_elevation(0.7 * i, 0.1 + 0.047 * i));
  std::vector<SatellitePaths> all(sky.size()), near(sky.size());
  std::vector<KnownEdge> edges;
  std::size_t reflected = 0, bent = 0, others = 0;
  for (double along = -200; along < 200; along += 7) {
    const Eigen::Vector3d antenna(along, 0.3, 2);
    propagator.trace(antenna, sky, all, &edges);
    propagator.trace_near(antenna, sky, edges, near);
    for (std::size_t i = 0; i < sky.size(); ++i) {
      std::vector<Path> expected;
      std::copy_if(all[i].paths.begin(), all[i].paths.end(), std::back_inserter(expected), is_near);
      others += all[i].paths.size() - expected.size();
      ASSERT_EQ(near[i].paths.size(), expected.size());
      for (std::size_t k = 0; k < expected.size(); ++k) {
        EXPECT_EQ(near[i].paths[k].kind, expected[k].kind);
        EXPECT_EQ(near[i].paths[k].excess_m, expected[k].excess_m);
        EXPECT_EQ(near[i].paths[k].reflector, expected[k].reflector);
        EXPECT_EQ(near[i].paths[k].edge_nu, expected[k].edge_nu);
        reflected += expected[k].kind == PathKind::Reflected;
        bent += expected[k].kind == PathKind::Diffracted;
      }
    }
  }
  // Both sets have members: paths to compare, and paths that are left out.
  EXPECT_GT(reflected, 100U);
  EXPECT_GT(bent, 100U);
  EXPECT_GT(others, 100U);
  // Without edges none is bent.
  propagator.trace_near({0, 0.3, 2}, sky, {}, near);
  for (const SatellitePaths& satellite : near) {
    for (const Path& path : satellite.paths) EXPECT_NE(path.kind, PathKind::Diffracted);
  }
}

}  // namespace
}  // namespace canyon::propagation
