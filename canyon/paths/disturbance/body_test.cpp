#include "canyon/paths/disturbance/streets.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/city.hpp"
#include "canyon/paths/propagation/index/knife_edge.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "tests/support/append_box.hpp"

namespace canyon::disturbance {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using geodesy::radians;
using propagation::Path;
using propagation::PathKind;

constexpr double kWavelength = geodesy::kSpeedOfLight / 1575.42e6;
constexpr double kFar = std::numeric_limits<double>::infinity();
const Vector3d kAntenna(0, 0, 1.8);

/// A box of length along `yaw` (from east), on the ground.
Body box(double east, double north, double yaw, double length, double width, double height) {
  Body body;
  body.centre = {east, north};
  body.ahead = {std::cos(yaw), std::sin(yaw)};
  body.half_length_m = length / 2;
  body.half_width_m = width / 2;
  body.top_m = height;
  body.sill_m = height;
  body.name = 7;
  return body;
}

Vector3d towards(double azimuth_deg, double elevation_deg) {
  return geodesy::enu_from_azimuth_elevation(radians(azimuth_deg), radians(elevation_deg));
}

Blockage blockage(const Body& body, const Vector3d& antenna, const Vector3d& arrival, double leg_m,
                  double wavelength_m) {
  return disturbance::blockage(body, SightLine(antenna, arrival, leg_m), wavelength_m);
}

double loss_db(const Blockage& shade) {
  return -20 * std::log10(shade.amplitude);
}

TEST(EdgeField, IsTheKnifeEdges) {
  for (double nu = -14; nu < 60; nu += 0.0137) {
    const std::complex<double> exact = propagation::knife_edge_field(nu);
    EXPECT_LT(std::abs(edge_field(nu) - exact), nu > 12 ? 3e-3 * std::abs(exact) : 2e-4) << nu;
  }
}

// The knife edge of ITU-R P.526-15, 4.1: nu = p sqrt(2 / (lambda r)), p the edge's distance from the ray, r
// along the ray (plane wave, p << r), loss by the approximation (31) there, which is good to 0.124 dB above
// nu = -0.78.
TEST(Blockage, OfALongWallIsTheKnifeEdgeOfItsTop) {
  for (const double top : {3.0, 3.5, 4.0, 4.5, 5.0}) {
    // 500 m to each side, 10 m north of the antenna.
    const Body wall = box(0, 10.01, 0, 1000, 0.02, top);
    for (const double elevation_deg : {8.0, 10.0, 14.0}) {
      const double e = radians(elevation_deg);
      const double h = top - kAntenna.z();
      const double p = h * std::cos(e) - 10 * std::sin(e);
      const double r = 10 * std::cos(e) + h * std::sin(e);
      const double nu = p * std::sqrt(2 / (kWavelength * r));
      if (nu < -0.7) continue;
      const Blockage shaded = blockage(wall, kAntenna, towards(0, elevation_deg), kFar, kWavelength);
      EXPECT_NEAR(loss_db(shaded), propagation::approximate_knife_edge_loss_db(nu), 0.25)
          << top << " m at " << elevation_deg;
      EXPECT_EQ(shaded.cuts, p > 0);
    }
  }
}

TEST(Blockage, OfASideIsTheKnifeEdgeOfAnUprightEdge) {
  // Infinite upwards and to the east: its western corner, 8 m ahead, is at the distance w from the ray.
  for (const double w : {-1.0, -0.3, 0.0, 0.5, 1.0, 2.0}) {
    const Body tower = box(500 - w, 8.01, 0, 1000, 0.02, 1e5);
    const double e = radians(30);
    const double nu = w * std::sqrt(2 * std::cos(e) / (kWavelength * 8));
    const Blockage shaded = blockage(tower, kAntenna, towards(0, 30), kFar, kWavelength);
    // Exact, by Sommerfeld's half plane; w is not small relative to r.
    EXPECT_NEAR(shaded.amplitude, std::abs(propagation::knife_edge_field(nu)), 0.01) << w;
    EXPECT_EQ(shaded.cuts, w > 0);
  }
}

TEST(Blockage, ChangesSteadilyFromLightToShadow) {
  // A bus passes: no step in amplitude as it arrives, covers and leaves.
  double before = 1;
  double least = 1;
  for (int i = 0; i <= 4000; ++i) {
    const Body bus = box(-20 + 0.01 * i, 4, 0, 12, 2.5, 4.4);
    const double now = blockage(bus, kAntenna, towards(0, 25), kFar, kWavelength).amplitude;
    // Ripples of 1 / (pi sqrt(2) 3) end if an edge is too far from the ray.
    EXPECT_LT(std::abs(now - before), 0.1) << i;
    before = now;
    least = std::min(least, now);
  }
  EXPECT_LT(20 * std::log10(least), -15);
}

TEST(Blockage, IsNoneOfWhatIsBehindTheReflectorOrTheAntenna) {
  const Body bus = box(0, 10, 0, 12, 2.5, 4.4);
  EXPECT_EQ(blockage(bus, kAntenna, towards(0, 5), 8, kWavelength).amplitude, 1);
  EXPECT_LT(blockage(bus, kAntenna, towards(0, 5), 20, kWavelength).amplitude, 0.3);
  EXPECT_EQ(blockage(bus, kAntenna, towards(180, 5), kFar, kWavelength).amplitude, 1);
}

TEST(Blockage, OfAFootbridgeCoversWhatIsAbove) {
  Body bridge = box(0, 0, 0, 4, 20, 8.5);
  bridge.bottom_m = 5.5;
  bridge.grounded = false;
  const Blockage above = blockage(bridge, kAntenna, Vector3d(0, 0, 1), kFar, kWavelength);
  EXPECT_TRUE(above.cuts);
  EXPECT_GT(loss_db(above), 10);
  // Its edge is 2 m east, 3.7 m high: 61.6 deg.
  EXPECT_TRUE(blockage(bridge, kAntenna, towards(90, 63), kFar, kWavelength).cuts);
  EXPECT_FALSE(blockage(bridge, kAntenna, towards(90, 60), kFar, kWavelength).cuts);
  EXPECT_GT(blockage(bridge, kAntenna, towards(90, 30), kFar, kWavelength).amplitude, 0.9);
}

TEST(CrownDepth, IsTheChordOfItsSphere) {
  Body tree;
  tree.kind = Body::Kind::Crown;
  tree.centre = {0, 6};
  tree.half_length_m = tree.half_width_m = 2.5;
  tree.bottom_m = 3;
  tree.top_m = 8;
  const Vector3d middle(0, 6, 5.5);
  const Vector3d to_middle = (middle - kAntenna).normalized();
  EXPECT_NEAR(crown_depth_m(tree, kAntenna, to_middle, kFar), 5, 1e-12);
  // Passing the middle at 1.5 m: 2 sqrt(2.5^2 - 1.5^2) = 4.
  const double rotation = std::asin(1.5 / (middle - kAntenna).norm());
  const Vector3d neighbour = (std::cos(rotation) * to_middle + std::sin(rotation) * Vector3d::UnitX());
  EXPECT_NEAR(crown_depth_m(tree, kAntenna, neighbour, kFar), 4, 1e-9);
  EXPECT_EQ(crown_depth_m(tree, kAntenna, Vector3d(0, -1, 0), kFar), 0);
  EXPECT_NEAR(crown_depth_m(tree, kAntenna, to_middle, (middle - kAntenna).norm()), 2.5, 1e-12);
}

// Image method: a plane d away lengthens the path by 2 d (s . n).
TEST(SideReflection, HasTheDetourOfTheImage) {
  const Body bus = box(0, 5 + 1.25, 0, 12, 2.5, 4.4);
  const auto path = side_reflection(bus, 1, kAntenna, towards(180, 15), kWavelength, 0);
  ASSERT_TRUE(path);
  EXPECT_NEAR(path->excess_m, 2 * 5 * std::cos(radians(15)), 1e-12);
  EXPECT_NEAR(path->point.x(), 0, 1e-12);
  EXPECT_NEAR(path->point.y(), 5, 1e-12);
  EXPECT_NEAR(path->point.z(), 1.8 + 5 * std::tan(radians(15)), 1e-12);
  EXPECT_NEAR(path->arrival.dot(towards(0, 15)), 1, 1e-12);
  EXPECT_NEAR(path->incidence_rad(), radians(15), 1e-12);
  EXPECT_EQ(path->incidences[0].material, city::Material::Metal);
  // The edge over the roof at the height of the mirror point: half of the field remains.
  const Body lower = box(0, 5 + 1.25, 0, 1000, 2.5, 1.8 + 5 * std::tan(radians(40)));
  const auto half = side_reflection(lower, 1, kAntenna, towards(180, 40), kWavelength, 0);
  ASSERT_TRUE(half);
  EXPECT_NEAR(half->amplitude_factor, 0.5, 0.04);  // ripple of the lower edge, nu = 6
  // Rays from behind and from inside give nothing.
  EXPECT_FALSE(side_reflection(bus, 1, kAntenna, towards(0, 15), kWavelength, 0));
  EXPECT_FALSE(side_reflection(bus, 0, kAntenna, towards(180, 15), kWavelength, 0));
}

// The same boxes as buildings of a scene, traced by the propagator: blocked satellites, and reflections.
TEST(Bodies, BlockAndReflectAsTheSceneOfTheSameBoxesDoes) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  int cut = 0, clear = 0, reflected = 0, spared = 0;
  for (int street = 0; street < 40; ++street) {
    std::vector<Body> bodies;
    city::Mesh mesh;
    for (int k = 0; k < 6; ++k) {
      const double azimuth = 2 * geodesy::kPi * (k + 0.8 * uniform(random)) / 6;
      const double distance = 8 + 6 * uniform(random);
      Body body = box(distance * std::cos(azimuth), distance * std::sin(azimuth),
                      2 * geodesy::kPi * uniform(random), 4, 2 + uniform(random), 2 + 5 * uniform(random));
      body.name = static_cast<std::uint64_t>(k + 1);
      bodies.push_back(body);
      canyon::test::append_box(
          mesh, "vehicle", city::Surface::Building, city::Material::Metal,
          {body.centre.x() - body.half_length_m, body.centre.y() - body.half_width_m, 0},
          {body.centre.x() + body.half_length_m, body.centre.y() + body.half_width_m, body.top_m},
          std::atan2(body.ahead.y(), body.ahead.x()));
    }
    const raytrace::RayScene scene(mesh);
    const propagation::Propagator propagator(mesh, scene, {});
    for (int i = 0; i < 100; ++i) {
      const Vector3d s = towards(360 * uniform(random), 3 + 50 * uniform(random));
      propagation::SatellitePaths traced;
      propagator.trace(kAntenna, {&s, 1}, {&traced, 1});
      const bool direct = std::any_of(traced.paths.begin(), traced.paths.end(),
                                      [](const Path& path) { return path.kind == PathKind::Direct; });
      const auto cuts = [&](const Vector3d& from, const Vector3d& to, double leg, std::uint64_t but) {
        return std::any_of(bodies.begin(), bodies.end(), [&](const Body& body) {
          return body.name != but && blockage(body, from, to, leg, kWavelength).cuts;
        });
      };
      EXPECT_EQ(cuts(kAntenna, s, kFar, 0), !direct) << street << " " << i;
      ++(direct ? clear : cut);

      std::vector<double> expected, found;
      for (const Path& path : traced.paths) {
        // Roofs below the antenna reflect as well, from below.
        if (path.kind == PathKind::Reflected && path.arrival.z() > 0) expected.push_back(path.excess_m);
      }
      for (const Body& body : bodies) {
        for (int side = 0; side < 4; ++side) {
          const auto path = side_reflection(body, side, kAntenna, s, kWavelength, 0);
          if (!path || !body.holds(path->point, 1e-9)) continue;
          const double leg = (path->point - kAntenna).norm();
          if (cuts(kAntenna, path->arrival, leg, body.name) || cuts(path->point, s, kFar, body.name)) {
            ++spared;
            continue;
          }
          found.push_back(path->excess_m);
        }
      }
      std::sort(expected.begin(), expected.end());
      std::sort(found.begin(), found.end());
      EXPECT_THAT(found, ::testing::Pointwise(::testing::DoubleNear(1e-6), expected)) << street << " " << i;
      reflected += static_cast<int>(found.size());
    }
  }
  EXPECT_GT(cut, 200);
  EXPECT_GT(clear, 200);
  EXPECT_GT(reflected, 50);
  EXPECT_GT(spared, 0);
}

}  // namespace
}  // namespace canyon::disturbance
