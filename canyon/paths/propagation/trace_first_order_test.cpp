#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cstdint>
#include <map>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "tests/support/append_box.hpp"

namespace canyon::propagation {
namespace {

bool is_near(const Path& path) {
  return path.kind != PathKind::Diffuse && path.order < 2;
}

/// Up to 84 deg of elevation, in a spiral. @param rotated_rad increment of azimuths, decrement of elevations
std::vector<Eigen::Vector3d> thirty_directions(double rotated_rad = 0) {
  std::vector<Eigen::Vector3d> directions;
  directions.reserve(30);
  for (int i = 0; i < 30; ++i) {
    directions.push_back(
        geodesy::enu_from_azimuth_elevation(0.7 * i + rotated_rad, 0.1 + 0.047 * i - rotated_rad));
  }
  return directions;
}

// With the edges of the point itself, equals Propagator::trace() without the paths that trace_first_order()
// omits: the same numbers.
TEST(Propagator, TraceNearGivesWhatTraceFinds) {
  city::City city = city::synthetic_city({});
  canyon::test::append_box(city.mesh, "hedge", city::Surface::Foliage, city::Material::Foliage, {-50, -3, 0},
                           {50, -2, 4});
  const raytrace::RayScene scene(city.mesh);
  PropagationOptions options;
  options.reflection_order = 2;
  options.ground_reflection = options.diffraction = options.diffuse = options.through_foliage = true;
  const Propagator propagator(city.mesh, scene, options);
  const std::vector<Eigen::Vector3d> sky = thirty_directions();
  std::vector<SatellitePaths> all(sky.size()), near(sky.size());
  TracedPoint traced;
  std::size_t reflected = 0, bent = 0, others = 0;
  for (double along = -200; along < 200; along += 7) {
    const Eigen::Vector3d antenna(along, 0.3, 2);
    propagator.trace(antenna, sky, all, &traced);
    propagator.trace_first_order(antenna, sky, traced.edges, near);
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
  // Both sets have members: compared paths, and omitted paths.
  EXPECT_GT(reflected, 100U);
  EXPECT_GT(bent, 100U);
  EXPECT_GT(others, 100U);
  // Without edges no path is diffracted.
  propagator.trace_first_order({0, 0.3, 2}, sky, {}, near);
  for (const SatellitePaths& satellite : near) {
    for (const Path& path : satellite.paths) EXPECT_NE(path.kind, PathKind::Diffracted);
  }
}

/// By their reflectors, of one kind and order.
std::map<std::uint64_t, Path> by_reflector(const SatellitePaths& satellite, PathKind kind, int order) {
  std::map<std::uint64_t, Path> result;
  for (const Path& path : satellite.paths) {
    if (path.kind == kind && path.order == order) result.emplace(path.reflector, path);
  }
  return result;
}

// Half a metre farther the updated paths equal those of a search there, to rounding; a second later the
// satellite's motion counts to first order.
TEST(Propagator, FarPathsGoAlong) {
  const city::City city = city::synthetic_city({});
  const raytrace::RayScene scene(city.mesh);
  PropagationOptions options;
  options.reflection_order = 2;
  options.diffraction = options.diffuse = true;
  const Propagator propagator(city.mesh, scene, options);
  const Eigen::Vector3d step(0.4, -0.2, 0.1);
  const std::vector<Eigen::Vector3d> sky = thirty_directions(), later = thirty_directions(1e-4);
  std::vector<SatellitePaths> here(sky.size()), expected(sky.size()), got(sky.size());
  std::size_t twice = 0, found_twice = 0;
  for (double along = -200; along < 200; along += 7) {
    const Eigen::Vector3d antenna(along, 0.3, 2), there = antenna + step;
    TracedPoint traced;
    propagator.trace(antenna, sky, here, &traced);
    for (const auto& directions : {sky, later}) {
      propagator.trace(there, directions, expected);
      ASSERT_TRUE(propagator.retrace(there, directions, traced, got));
      const bool rotated = directions != sky;
      for (std::size_t i = 0; i < sky.size(); ++i) {
        const auto searched = by_reflector(expected[i], PathKind::Reflected, 2);
        twice += searched.size();
        for (const auto& [reflector, path] : by_reflector(got[i], PathKind::Reflected, 2)) {
          const auto found = searched.find(reflector);
          if (found == searched.end()) continue;
          ++found_twice;
          const Path& right = found->second;
          EXPECT_NEAR(path.excess_m, right.excess_m, rotated ? 2e-4 : 1e-9);
          EXPECT_NEAR((path.arrival - right.arrival).norm(), 0, rotated ? 3e-4 : 1e-12);
          if (rotated) continue;
          EXPECT_NEAR((path.point - right.point).norm(), 0, 1e-6);
          EXPECT_NEAR((path.far_point - right.far_point).norm(), 0, 1e-6);
          EXPECT_NEAR(path.leg_m, right.leg_m, 1e-6);
        }
        // The point of a facade is fixed, and its direction is that from the new point.
        for (const auto& [reflector, path] : by_reflector(got[i], PathKind::Diffuse, 0)) {
          EXPECT_NEAR((path.point - there).normalized().dot(path.arrival), 1, 1e-12);
          EXPECT_GE(path.excess_m, 0);
        }
        EXPECT_TRUE(std::is_sorted(got[i].paths.begin(), got[i].paths.end(), comes_before));
      }
    }
  }
  EXPECT_GT(twice, 400U);
  EXPECT_GT(static_cast<double>(found_twice), 0.85 * static_cast<double>(twice));
}

// A stationary bus is part of it, one that drives off is not, and one that is far away does not matter.
TEST(Propagator, FarPathsHoldWhileInstancesStand) {
  const city::City city = city::synthetic_city({});
  city::Mesh bus;
  canyon::test::append_box(bus, "bus", city::Surface::Vehicle, city::Material::Metal, {-6, -1.3, 0},
                           {6, 1.3, 3});
  raytrace::RayScene scene(city.mesh);
  const auto at = [](double east) { return Eigen::Isometry3d(Eigen::Translation3d(east, 4, 0)); };
  const raytrace::InstanceId near = scene.add_instance(bus), far = scene.add_instance(bus);
  scene.set_pose(near, at(12));
  scene.set_pose(far, at(2000));
  scene.commit();
  PropagationOptions options;
  options.reflection_order = 2;
  options.diffraction = options.diffuse = true;
  const Propagator propagator(city.mesh, scene, options);
  const std::vector<Eigen::Vector3d> sky = thirty_directions();
  std::vector<SatellitePaths> all(sky.size()), again(sky.size());
  TracedPoint traced;
  const Eigen::Vector3d antenna(0, 0.3, 2);
  propagator.trace(antenna, sky, all, &traced);
  scene.set_pose(far, at(2010));
  scene.commit();
  EXPECT_TRUE(propagator.has_far_paths());
  ASSERT_TRUE(propagator.retrace(antenna, sky, traced, again));
  std::size_t over_bus = 0;
  for (std::size_t i = 0; i < sky.size(); ++i) {
    ASSERT_EQ(again[i].paths.size(), all[i].paths.size());
    for (std::size_t k = 0; k < all[i].paths.size(); ++k) {
      EXPECT_NEAR(again[i].paths[k].excess_m, all[i].paths[k].excess_m, 1e-9);
      over_bus += all[i].paths[k].instance == near;
    }
  }
  EXPECT_GT(over_bus, 3U);
  scene.set_pose(near, at(12.1));
  scene.commit();
  EXPECT_FALSE(propagator.retrace(antenna, sky, traced, again));
}

// For a wall that scatters once, the detour of a point is known in closed form.
TEST(FarScatter, OfAPointOnAFacade) {
  const Eigen::Vector3d from(0, 0, 2), antenna(0.3, 0.5, 2.1), point(20, 5, 12);
  const Eigen::Vector3d s = geodesy::enu_from_azimuth_elevation(0.3, 0.7);
  const auto detour_m = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& towards) {
    return (point - a).norm() - towards.dot(point - a);
  };
  FarScatter far;
  far.path.point = point;
  far.path.arrival = (point - from).normalized();
  far.path.excess_m = detour_m(from, s);
  const auto seen = far.seen_from(antenna, s, from, s);
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->excess_m, detour_m(antenna, s), 1e-12);
  const Eigen::Vector3d later = geodesy::enu_from_azimuth_elevation(0.3 + 1e-4, 0.7 - 1e-4);
  EXPECT_NEAR(far.seen_from(antenna, later, from, s)->excess_m, detour_m(antenna, later), 2e-4);
}

// Other satellites: the caller has to trace.
TEST(Propagator, FarPathsAreOfTheSameSatellites) {
  const city::City city = city::synthetic_city({});
  const raytrace::RayScene scene(city.mesh);
  PropagationOptions options;
  options.diffuse = true;
  const Propagator propagator(city.mesh, scene, options);
  EXPECT_TRUE(propagator.has_far_paths());
  std::vector<Eigen::Vector3d> sky{geodesy::enu_from_azimuth_elevation(0.3, 0.7),
                                   geodesy::enu_from_azimuth_elevation(2.3, 0.5)};
  std::vector<SatellitePaths> paths(2);
  TracedPoint traced;
  propagator.trace({0, 0.3, 2}, sky, paths, &traced);
  EXPECT_TRUE(propagator.retrace({0, 0.3, 2}, sky, traced, paths));
  std::swap(sky[0], sky[1]);
  EXPECT_FALSE(propagator.retrace({0, 0.3, 2}, sky, traced, paths));
  sky.pop_back();
  paths.pop_back();
  EXPECT_FALSE(propagator.retrace({0, 0.3, 2}, sky, traced, paths));
  EXPECT_FALSE(propagator.retrace({0, 0.3, 2}, sky, {}, paths));
  options.diffuse = false;
  EXPECT_FALSE(Propagator(city.mesh, scene, options).has_far_paths());
}

}  // namespace
}  // namespace canyon::propagation
