#include "canyon/city/link_shapes.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/mesh_topology.hpp"

namespace canyon::city {
namespace {

using Eigen::Vector3d;
using geodesy::kPi;

double area_of(const TriangleSet& set) {
  double area = 0;
  for (const auto& [a, b, c] : set.triangles) {
    area += (set.vertices[b] - set.vertices[a]).cross(set.vertices[c] - set.vertices[a]).norm() / 2;
  }
  return area;
}

double volume_of(const TriangleSet& set) {
  double volume = 0;
  for (const auto& [a, b, c] : set.triangles) {
    volume += set.vertices[a].dot(set.vertices[b].cross(set.vertices[c])) / 6;
  }
  return volume;
}

/// Closed, front sides out: every edge occurs once in each direction.
bool watertight(TriangleSet set) {
  const OrientedSolids orientation = orient_outwards(set.vertices, set.triangles);
  return orientation.closed && orientation.manifold && orientation.flipped_count == 0 &&
         orientation.volume_m3 > 0;
}

TEST(PrimitiveMeshes, VolumesFollowClosedForms) {
  EXPECT_NEAR(volume_of(box_mesh({2, 3, 5})), 30, 1e-12);
  // A prism over a regular polygon of n sides: n/2 r^2 sin(2 pi / n) h.
  EXPECT_NEAR(volume_of(cylinder_mesh(2, 5)), 16 * 4 * std::sin(2 * kPi / 32) * 5, 1e-12);
  const double sphere = 4.0 / 3 * kPi * 27;
  EXPECT_LT(volume_of(sphere_mesh(3)), sphere);
  EXPECT_GT(volume_of(sphere_mesh(3)), 0.97 * sphere);
  EXPECT_TRUE(watertight(box_mesh({2, 3, 5})));
  EXPECT_TRUE(watertight(cylinder_mesh(2, 5)));
  EXPECT_TRUE(watertight(sphere_mesh(3)));
  for (const Eigen::Vector3d& v : sphere_mesh(3).vertices) EXPECT_NEAR(v.norm(), 3, 1e-12);
}

TEST(PrimitiveMeshes, PlaneFacesItsNormal) {
  const Eigen::Vector3d normal = Eigen::Vector3d(1, -2, 0.5).normalized();
  const TriangleSet set = plane_mesh(normal, {3, 4});
  for (const auto& [a, b, c] : set.triangles) {
    const Eigen::Vector3d n = (set.vertices[b] - set.vertices[a]).cross(set.vertices[c] - set.vertices[a]);
    EXPECT_LT((n - 12 * normal).norm(), 1e-12);
  }
}

/// Volume and area converge to those of the smooth body with the square of the number of sides, from below.
void expect_second_order(const std::function<TriangleSet(int sides)>& mesh, double volume, double area) {
  const auto missing = [&](int sides) {
    const TriangleSet set = mesh(sides);
    return Eigen::Vector2d(1 - volume_of(set) / volume, 1 - area_of(set) / area);
  };
  const Eigen::Vector2d coarse = missing(64), fine = missing(128);
  EXPECT_GT(fine.minCoeff(), 0);
  EXPECT_LT(fine.maxCoeff(), 2e-3);
  EXPECT_NEAR(coarse.x() / fine.x(), 4, 0.05);
  EXPECT_NEAR(coarse.y() / fine.y(), 4, 0.05);
}

TEST(PrimitiveMeshes, Cone) {
  // A pyramid over a regular polygon: a third of the prism.
  EXPECT_NEAR(volume_of(cone_mesh(2, 5)), 16 * 4 * std::sin(2 * kPi / 32) * 5 / 3, 1e-12);
  EXPECT_TRUE(watertight(cone_mesh(2, 5)));
  expect_second_order([](int sides) { return cone_mesh(2, 5, sides); }, kPi * 4 * 5 / 3,
                      kPi * 2 * (2 + std::hypot(2, 5)));
  for (const Vector3d& v : cone_mesh(2, 5).vertices) {
    const double radius = v.head<2>().norm();
    EXPECT_TRUE(std::abs(radius - 2 * (2.5 - v.z()) / 5) < 1e-12 || v == Vector3d(0, 0, -2.5));
  }
}

TEST(PrimitiveMeshes, Capsule) {
  const double r = 2, length = 5;
  expect_second_order([&](int sides) { return capsule_mesh(r, length, sides); },
                      kPi * r * r * length + 4.0 / 3 * kPi * r * r * r,
                      2 * kPi * r * length + 4 * kPi * r * r);
  const TriangleSet set = capsule_mesh(r, length);
  EXPECT_TRUE(watertight(set));
  double top = 0;
  for (const Vector3d& v : set.vertices) {
    const Vector3d nearest_on_axis(0, 0, std::clamp(v.z(), -length / 2, length / 2));
    EXPECT_NEAR((v - nearest_on_axis).norm(), r, 1e-12);
    top = std::max(top, v.z());
  }
  EXPECT_NEAR(top, 4.5, 1e-12);
  // Without a length it is a sphere.
  EXPECT_TRUE(watertight(capsule_mesh(r, 0)));
  EXPECT_NEAR(volume_of(capsule_mesh(r, 0)), volume_of(sphere_mesh(r)), 1e-12);
}

TEST(PrimitiveMeshes, Ellipsoid) {
  // Areas of the spheroids that are flat and long along z: 2 pi a^2 (1 + (1 - e^2) / e artanh e) and
  // 2 pi a^2 (1 + c / (a e) arcsin e).
  const double flat = std::sqrt(1 - 1.0 / 9), slim = std::sqrt(1 - 1.0 / 4);
  expect_second_order(
      [](int sides) {
        return ellipsoid_mesh({3, 3, 1}, sides);
      },
      4.0 / 3 * kPi * 9, 2 * kPi * 9 * (1 + (1 - flat * flat) / flat * std::atanh(flat)));
  expect_second_order(
      [](int sides) {
        return ellipsoid_mesh({2, 2, 4}, sides);
      },
      4.0 / 3 * kPi * 16, 2 * kPi * 4 * (1 + 4 / (2 * slim) * std::asin(slim)));
  const Vector3d radii(1, 2, 5);
  const TriangleSet set = ellipsoid_mesh(radii);
  EXPECT_TRUE(watertight(set));
  EXPECT_NEAR(volume_of(set), 10 * volume_of(sphere_mesh(1)), 1e-12);
  for (const Vector3d& v : set.vertices) EXPECT_NEAR(v.cwiseQuotient(radii).norm(), 1, 1e-12);
  for (const auto& [a, b, c] : set.triangles) {
    const Vector3d &p = set.vertices[a], &q = set.vertices[b], &s = set.vertices[c];
    EXPECT_GT((q - p).cross(s - p).dot((p + q + s).cwiseQuotient(radii.cwiseAbs2())), 0) << "looks inwards";
  }
}

}  // namespace
}  // namespace canyon::city
