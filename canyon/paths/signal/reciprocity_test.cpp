// Both ends of a street canyon may be exchanged: paths by two walls between two antennas at finite distances,
// by the double image from either end, have the same length, and from RHCP to RHCP the same amplitude.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <complex>
#include <optional>
#include <random>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/paths/signal/path_strength.hpp"
#include "canyon/paths/signal/radio_materials.hpp"

namespace canyon::signal {
namespace {

using city::Material;
using Eigen::Vector3d;
using geodesy::radians;

/// n . x = offset
struct Wall {
  Vector3d normal;
  double offset;
  Material material;
  [[nodiscard]] Vector3d image(const Vector3d& p) const { return p - 2 * (normal.dot(p) - offset) * normal; }
};

struct FoundPath {
  double length_m;
  propagation::PathGeometry geometry;
};

/// From `source` over both walls to `receiver`; empty if the images give no such path in front of the
/// (infinite) walls.
std::optional<FoundPath> path(const Vector3d& source, const Wall& first, const Wall& second,
                              const Vector3d& receiver) {
  const Vector3d in_second = second.image(receiver), in_both = first.image(in_second);
  const auto meet = [](const Vector3d& from, const Vector3d& to, const Wall& wall) -> Vector3d {
    const double along = (wall.offset - wall.normal.dot(from)) / wall.normal.dot(to - from);
    return from + along * (to - from);
  };
  const Vector3d a = meet(source, in_both, first), b = meet(a, in_second, second);
  const Vector3d k0 = (a - source).normalized(), k1 = (b - a).normalized(), k2 = (receiver - b).normalized();
  const double cos_a = -first.normal.dot(k0), cos_b = -second.normal.dot(k1);
  if (cos_a <= 0.01 || cos_b <= 0.01 || second.normal.dot(k2) <= 0 || first.normal.dot(k1) <= 0) return {};
  FoundPath result;
  result.length_m = (a - source).norm() + (b - a).norm() + (receiver - b).norm();
  EXPECT_NEAR(result.length_m, (source - in_both).norm(), 1e-9);
  result.geometry.incidence_count = 2;
  result.geometry.incidences[0].incidence_rad = std::acos(cos_a);
  result.geometry.incidences[0].material = first.material;
  result.geometry.incidences[1].incidence_rad = std::acos(cos_b);
  result.geometry.incidences[1].material = second.material;
  result.geometry.incidences[1].plane_rotation_rad =
      propagation::plane_rotation_rad(k1, first.normal, second.normal);
  result.geometry.excess_m = result.length_m - (receiver - source).norm();
  return result;
}

TEST(Reciprocity, OfTwoWalls) {
  constexpr double kL1 = 1575.42e6;
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> along(-60, 60), across(-14, 14), height(0, 40), rotation(-0.6, 0.6);
  int paths = 0, rotated = 0;
  for (int i = 0; i < 500; ++i) {
    // Parallel walls every second time, else rotated and tilted.
    const bool parallel = i % 2 == 0;
    const Eigen::AngleAxisd yaw(parallel ? 0 : rotation(random), Vector3d::UnitZ()),
        lean(parallel ? 0 : rotation(random) / 4, Vector3d::UnitX());
    const Wall north{-Vector3d::UnitY(), -15, Material::Brick};
    const Wall south{yaw * lean * Vector3d::UnitY(), -40, Material::Glass};
    const Vector3d a(along(random), across(random), height(random)),
        b(along(random), across(random), height(random));
    const auto there = path(a, north, south, b), back = path(b, south, north, a);
    ASSERT_EQ(there.has_value(), back.has_value());
    if (!there) continue;
    ++paths;
    rotated += std::abs(std::sin(there->geometry.incidences[1].plane_rotation_rad)) > 0.05 ? 1 : 0;
    EXPECT_NEAR(there->length_m, back->length_m, 1e-9);
    if (parallel) {
      // Closed form: two walls D apart move the image 2 D along the normal.
      const double across_m = 2 * 55 + (b.y() - a.y());
      EXPECT_NEAR(there->length_m, std::hypot(across_m, std::hypot(b.x() - a.x(), b.z() - a.z())), 1e-9);
    }
    const CircularWave forth = arriving_wave(there->geometry, kL1), home = arriving_wave(back->geometry, kL1);
    // A nanometre of the length is 3e-8 of a cycle.
    EXPECT_LT(std::abs(forth.rhcp - home.rhcp), 1e-7);
    EXPECT_NEAR(std::abs(forth.rhcp), std::abs(home.rhcp), 1e-12);
    EXPECT_GT(std::abs(forth.rhcp), 1e-4);
  }
  EXPECT_GT(paths, 300);
  EXPECT_GT(rotated, 50);
}

}  // namespace
}  // namespace canyon::signal
