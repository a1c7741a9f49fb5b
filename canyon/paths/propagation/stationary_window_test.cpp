// The cache of a nearly stationary antenna does not change paths: an antenna that moves in small steps has
// exactly the paths that a new propagator traces in a new thread.

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <random>
#include <thread>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "tests/support/append_box.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Vector3d;

std::vector<Vector3d> sky(double rotated_rad) {
  constexpr int kDirections = 70;  // two groups of DirectionBins
  std::vector<Vector3d> result;
  result.reserve(kDirections);
  for (int i = 0; i < kDirections; ++i)
    result.push_back(geodesy::enu_from_azimuth_elevation(0.7 * i + rotated_rad, 0.1 + 0.02 * i));
  return result;
}

struct Counts {
  int reflected_twice = 0, diffracted = 0;
};

Counts drive(const city::Mesh& mesh, const Vector3d& from, const Vector3d& step, int steps) {
  const raytrace::RayScene scene(mesh);
  PropagationOptions options;
  options.reflection_order = 2;
  options.diffraction = options.ground_reflection = true;
  const Propagator propagator(mesh, scene, options);
  Counts counts;
  for (int i = 0; i < steps; ++i) {
    const Vector3d antenna = from + i * step;
    const std::vector<Vector3d> directions = sky(2e-4 * i);
    std::vector<SatellitePaths> moving(directions.size()), alone(directions.size());
    propagator.trace(antenna, directions, moving);
    const Propagator unused(mesh, scene, options);
    std::thread([&] { unused.trace(antenna, directions, alone); }).join();
    for (std::size_t k = 0; k < directions.size(); ++k) {
      EXPECT_EQ(moving[k].visibility, alone[k].visibility);
      if (moving[k].paths.size() != alone[k].paths.size()) {
        ADD_FAILURE() << "step " << i << ", satellite " << k;
        return counts;
      }
      for (std::size_t p = 0; p < moving[k].paths.size(); ++p) {
        const Path &a = moving[k].paths[p], &b = alone[k].paths[p];
        EXPECT_EQ(a.kind, b.kind);
        EXPECT_EQ(a.reflector, b.reflector);
        EXPECT_EQ(a.excess_m, b.excess_m);
        EXPECT_EQ(a.point, b.point);
        counts.reflected_twice += a.order == 2 ? 1 : 0;
        counts.diffracted += a.kind == PathKind::Diffracted ? 1 : 0;
      }
    }
  }
  return counts;
}

TEST(StationaryWindow, AntennasInStreetsKeepTheirPaths) {
  const Counts counts = drive(city::synthetic_city({}).mesh, {-60, 0.3, 2}, {0.4, 0.01, 0.001}, 150);
  EXPECT_GT(counts.reflected_twice, 500);
  EXPECT_GT(counts.diffracted, 500);
}

TEST(StationaryWindow, AntennasBesideMirrorsOfEveryTiltKeepTheirPaths) {
  city::Mesh mesh;
  canyon::test::append_box(mesh, "ground", city::Surface::Terrain, city::Material::Ground, {-100, -100, -1},
                           {100, 100, 0});
  const std::size_t first = mesh.vertices.size();
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> coordinate(-45, 45), size(2, 12), angle(0, geodesy::kPi);
  for (int i = 0; i < 60; ++i) {
    const std::size_t begin = mesh.vertices.size();
    const Vector3d half(size(random), size(random), size(random));
    canyon::test::append_box(mesh, "box", city::Surface::Building, city::Material::Glass, -half, half, 0);
    const Vector3d axis = Vector3d(coordinate(random), coordinate(random), coordinate(random)).normalized();
    const Vector3d middle(coordinate(random), coordinate(random), 8 + size(random));
    const Eigen::AngleAxisd rotation(angle(random), axis);
    for (std::size_t v = begin; v < mesh.vertices.size(); ++v)
      mesh.vertices[v] = rotation * mesh.vertices[v] + middle;
  }
  ASSERT_GT(mesh.vertices.size(), first);
  const Counts counts = drive(mesh, {-30, 1, 2}, {0.35, 0.05, 0.02}, 150);
  EXPECT_GT(counts.reflected_twice, 200);
  EXPECT_GT(counts.diffracted, 500);
}

}  // namespace
}  // namespace canyon::propagation
