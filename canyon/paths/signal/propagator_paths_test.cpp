// The contents of a traced path (geometry, reflector, image), and the kinds other than reflections: around
// edges, diffuse, through vegetation.

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <complex>
#include <random>
#include <set>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/paths/propagation/index/knife_edge.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/paths/signal/path_strength.hpp"
#include "canyon/paths/signal/radio_materials.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/edge_reference.hpp"

namespace canyon::signal::propagator_paths_test {
namespace {

using city::Material;
using city::Mesh;
using city::Surface;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using geodesy::radians;
using raytrace::RayScene;
using Complex = std::complex<double>;

constexpr double kL1 = 1575.42e6;

Vector3d direction(double azimuth_deg, double elevation_deg) {
  return geodesy::enu_from_azimuth_elevation(radians(azimuth_deg), radians(elevation_deg));
}

void append(Mesh& mesh, const Vector3d& min, const Vector3d& max, Material material = Material::Brick,
            Surface surface = Surface::Building) {
  canyon::test::append_box(mesh, "box", surface, material, min, max);
}

struct World {
  Mesh mesh;
  RayScene scene;
  propagation::Propagator propagator;

  explicit World(const Mesh& m, const propagation::PropagationOptions& options = {})
      : mesh(m), scene(mesh), propagator(mesh, scene, options) {}
  propagation::SatellitePaths trace(const Vector3d& antenna, const Vector3d& satellite) const {
    propagation::SatellitePaths result;
    propagator.trace(antenna, {&satellite, 1}, {&result, 1});
    return result;
  }
};

propagation::PropagationOptions order(int reflections) {
  propagation::PropagationOptions options;
  options.reflection_order = reflections;
  return options;
}
propagation::PropagationOptions everything() {
  propagation::PropagationOptions options = order(2);
  options.diffraction = options.diffuse = options.through_foliage = options.ground_reflection = true;
  return options;
}

/// The paths of one kind.
std::vector<propagation::Path> paths_of_kind(const propagation::SatellitePaths& satellite,
                                             propagation::PathKind kind) {
  std::vector<propagation::Path> paths;
  for (const propagation::Path& path : satellite.paths)
    if (path.kind == kind) paths.push_back(path);
  return paths;
}

/// A street along x, 30 m wide: brick to the north, metal to the south.
Mesh street() {
  Mesh mesh;
  append(mesh, {-200, 15, 0}, {200, 30, 60}, Material::Brick);
  append(mesh, {-200, -30, 0}, {200, -15, 60}, Material::Metal);
  return mesh;
}

// ---- geometry of reflections

TEST(PathGeometry, OfOneReflection) {
  Mesh mesh;
  append(mesh, {-200, 15, 0}, {200, 30, 60}, Material::Brick);
  const Vector3d s = direction(200, 30);
  const propagation::SatellitePaths satellite = World(mesh).trace({0, 0, 2}, s);
  ASSERT_EQ(satellite.paths.size(), 2u);
  const propagation::Path& direct = satellite.paths[0];
  EXPECT_NEAR(direct.arrival_elevation_rad, radians(30), 1e-12);
  EXPECT_EQ(direct.incidence_count, 0);
  EXPECT_EQ(direct.reflector, 0u);
  const propagation::Path& path = satellite.paths[1];
  // The wall's normal is -y: cos(incidence) = cos(elevation) cos(azimuth off south).
  const double cosine = std::cos(radians(30)) * std::cos(radians(20));
  EXPECT_EQ(path.incidence_count, 1);
  EXPECT_NEAR(path.incidences[0].incidence_rad, std::acos(cosine), 1e-12);
  EXPECT_EQ(path.incidences[0].material, Material::Brick);
  EXPECT_EQ(path.incidences[0].plane_rotation_rad, 0);
  EXPECT_EQ(path.incidences[0].specular_factor, 1);
  EXPECT_FALSE(path.incidences[0].thickness_m);
  EXPECT_NEAR(path.excess_m, 30 * cosine, 1e-9);
  EXPECT_NEAR(path.arrival_elevation_rad, radians(30), 1e-12);
  EXPECT_FALSE(path.edge_nu);
  EXPECT_NE(path.reflector, 0u);
}

// From the satellite in the south over the brick wall in the north and the metal wall to the antenna: brick
// first.
TEST(PathGeometry, OfTwoReflectionsIsInTheOrderFromTheSatellite) {
  const World world(street(), order(2));
  bool seen = false;
  for (const propagation::Path& path : world.trace({0, 0, 2}, direction(200, 45)).paths) {
    if (path.order != 2) continue;
    seen = true;
    ASSERT_GT(path.far_point.y(), 14);
    ASSERT_LT(path.point.y(), -14);
    EXPECT_EQ(path.incidence_count, 2);
    EXPECT_EQ(path.incidences[0].material, Material::Brick);
    EXPECT_EQ(path.incidences[1].material, Material::Metal);
    const double incidence = std::acos(std::cos(radians(45)) * std::cos(radians(20)));
    EXPECT_NEAR(path.incidences[0].incidence_rad, incidence, 1e-9);
    EXPECT_NEAR(path.incidences[1].incidence_rad, incidence, 1e-9);
    EXPECT_EQ(path.incidences[0].plane_rotation_rad, 0);
    // Opposite normals: the s axes are opposite.
    EXPECT_NEAR(std::abs(path.incidences[1].plane_rotation_rad), geodesy::kPi, 1e-6);
  }
  EXPECT_TRUE(seen);
}

// Ground, then wall: the rotation of the plane of incidence by the definition of its axes, s = k x n.
TEST(PathGeometry, PlaneTurnsBetweenGroundAndWall) {
  Mesh mesh;
  append(mesh, {-200, 15, -1}, {200, 30, 60}, Material::Glass);
  city::append_object(mesh, "ground", Surface::Terrain, Material::Ground,
                      {{-200, -200, 0}, {200, -200, 0}, {200, 15, 0}, {-200, 15, 0}}, {{0, 1, 2}, {0, 2, 3}});
  propagation::PropagationOptions options = order(2);
  options.ground_reflection = true;
  const Vector3d s = direction(215, 25);
  std::vector<propagation::Path> paths;
  for (const propagation::Path& path : World(mesh, options).trace({0, 0, 5}, s).paths)
    if (path.order == 2) paths.push_back(path);
  ASSERT_EQ(paths.size(), 1u);  // same image for ground first or wall first: one of them is possible
  const propagation::PathGeometry& geometry = paths[0];
  const bool ground_first = geometry.incidences[0].material == Material::Ground;
  EXPECT_EQ(geometry.incidences[1].material, ground_first ? Material::Glass : Material::Ground);
  const Vector3d up = Vector3d::UnitZ(), south = -Vector3d::UnitY();
  const Vector3d first = ground_first ? up : south, second = ground_first ? south : up;
  const Vector3d k = -s + 2 * s.dot(first) * first;  // the wave after the first
  const Vector3d a = k.cross(first).normalized(), b = k.cross(second).normalized();
  EXPECT_NEAR(geometry.incidences[1].plane_rotation_rad, std::atan2(k.dot(a.cross(b)), a.dot(b)), 1e-9);
  EXPECT_GT(std::abs(geometry.incidences[1].plane_rotation_rad), 0.3);
}

TEST(PathGeometry, OfInstances) {
  RayScene scene{Mesh{}};
  Mesh bus;
  append(bus, {-6, -1, 0}, {6, 1, 4}, Material::Metal, Surface::Vehicle);
  const auto hidden = scene.add_instance(bus), id = scene.add_instance(bus);
  static_cast<void>(hidden);
  scene.set_pose(id, Isometry3d(Eigen::Translation3d(0, 5, 0) * Eigen::AngleAxisd(0.1, Vector3d::UnitZ())));
  scene.commit();
  const propagation::Propagator propagator({}, scene, {});
  const Vector3d s = direction(170, 20);
  propagation::SatellitePaths satellite;
  propagator.trace({0, 0, 1}, {&s, 1}, {&satellite, 1});
  ASSERT_EQ(satellite.paths.size(), 2u);
  EXPECT_EQ(satellite.paths[1].instance, id);
  EXPECT_EQ(satellite.paths[1].incidences[0].material, Material::Metal);
  EXPECT_EQ(satellite.paths[1].incidences[0].incidence_rad, satellite.paths[1].incidence_rad());
  // The bus drives off; it is the same reflector.
  const std::uint64_t before = satellite.paths[1].reflector;
  scene.set_pose(id,
                 Isometry3d(Eigen::Translation3d(1, 5.5, 0) * Eigen::AngleAxisd(0.05, Vector3d::UnitZ())));
  scene.commit();
  propagator.trace({0, 0, 1}, {&s, 1}, {&satellite, 1});
  ASSERT_EQ(satellite.paths.size(), 2u);
  EXPECT_EQ(satellite.paths[1].reflector, before);
}

// ---- reflectors

TEST(Reflector, NamesDiffer) {
  std::set<std::uint64_t> seen;
  for (const propagation::PathKind kind :
       {propagation::PathKind::Reflected, propagation::PathKind::Diffracted, propagation::PathKind::Diffuse})
    for (std::uint32_t a = 0; a < 50; ++a) {
      EXPECT_TRUE(seen.insert(reflector_id(kind, {a})).second);
      for (std::uint32_t b = 0; b < 50; ++b) EXPECT_TRUE(seen.insert(reflector_id(kind, {a, b})).second);
    }
  EXPECT_FALSE(seen.count(0));
  EXPECT_EQ(reflector_id(propagation::PathKind::Reflected, {1, 2}),
            reflector_id(propagation::PathKind::Reflected, {1, 2}));
  EXPECT_NE(reflector_id(propagation::PathKind::Reflected, {1, 2}),
            reflector_id(propagation::PathKind::Reflected, {2, 1}));
}

// Along a wall the triangle changes and the reflector does not.
TEST(Reflector, IsTheFacet) {
  Mesh mesh;
  append(mesh, {-200, 15, 0}, {200, 30, 80});
  append(mesh, {-200, -30, 0}, {200, -15, 60});
  const World world(mesh, order(2));
  std::set<std::uint64_t> first, second;
  std::set<std::uint32_t> triangles;
  for (double x = -120; x <= 120; x += 1) {
    for (const propagation::Path& path : world.trace({x, 0, 2}, direction(225, 45)).paths) {
      if (path.order == 1) first.insert(path.reflector);
      if (path.order == 2) second.insert(path.reflector);
      if (path.order == 1) triangles.insert(path.triangle);
    }
  }
  EXPECT_EQ(first.size(), 1u);
  EXPECT_EQ(second.size(), 1u);
  EXPECT_EQ(triangles.size(), 2u);
  EXPECT_NE(*first.begin(), *second.begin());
  // In both orders: the wall in the south, and both walls in reverse order.
  for (const propagation::Path& path : world.trace({0, 0, 2}, direction(-45, 45)).paths) {
    EXPECT_FALSE(first.count(path.reflector));
    EXPECT_FALSE(second.count(path.reflector));
  }
}

// Walls drawn twice; rounding decides which one is found first.
TEST(Reflector, OfWallsDrawnTwiceIsOne) {
  Mesh mesh;
  append(mesh, {-200, 15, 0}, {200, 30, 60});
  append(mesh, {-200, 15.0000001, 0}, {200, 30, 60});
  append(mesh, {-200, 15, 0}, {200, 30, 60});
  const World world(mesh);
  std::set<std::uint64_t> seen;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> at(-10, 10);
  for (int i = 0; i < 200; ++i) {
    const propagation::SatellitePaths paths =
        world.trace({at(random), at(random), 2}, direction(180 + at(random), 40));
    ASSERT_EQ(paths.paths.size(), 2u);
    seen.insert(paths.paths[1].reflector);
  }
  EXPECT_EQ(seen.size(), 1u);
}

// ---- mirror model

TEST(MirrorPaths, ComeOverTheFacetThatTheRayMeets) {
  propagation::PropagationOptions options;
  options.model = propagation::Model::Mirror;
  Mesh mesh = street();
  const World world(mesh, options);
  const Vector3d s = direction(200, 20);
  const propagation::SatellitePaths paths = world.trace({0, 0, 2}, s);
  ASSERT_EQ(paths.visibility, propagation::Visibility::NLOS);
  const propagation::Path& path = paths.paths.at(0);
  EXPECT_EQ(path.incidence_count, 1);
  EXPECT_EQ(path.incidences[0].material, Material::Brick);
  EXPECT_NEAR(path.incidences[0].incidence_rad, std::acos(std::cos(radians(20)) * std::cos(radians(20))),
              1e-9);
  EXPECT_NEAR(path.arrival_elevation_rad, radians(20), 1e-9);
  std::set<std::uint64_t> along, triangles;
  for (double x = -180; x <= 180; x += 2) {
    const propagation::Path other = world.trace({x, 0, 2}, s).paths.at(0);
    along.insert(other.reflector);
    triangles.insert(other.triangle);
  }
  EXPECT_EQ(along.size(), 1u);
  EXPECT_EQ(triangles.size(), 2u);
  // Rays of another caster: concrete that faces the arrival.
  const propagation::Path foreign = propagation::mirror_paths({0, 0, 2}, s, true, 16).paths.at(0);
  EXPECT_EQ(foreign.incidences[0].material, Material::Concrete);
  EXPECT_NEAR(foreign.incidences[0].incidence_rad, radians(20), 1e-9);
  EXPECT_NE(foreign.reflector, 0u);
  EXPECT_NEAR(propagation::mirror_paths({0, 0, 2}, s, false, {}).paths.at(0).arrival_elevation_rad,
              radians(20), 1e-9);
}

// ---- edges

/// A long house to the north, 10 m high, its front 20 m away.
Mesh house() {
  Mesh mesh;
  append(mesh, {-500, 20, 0}, {500, 400, 10});
  return mesh;
}

propagation::PropagationOptions edges_only() {
  propagation::PropagationOptions options = order(0);
  options.diffraction = true;
  return options;
}

// Satellite straight behind the roof's edge: d = 20 m, h = 8 m (docs/propagation.md).
TEST(DiffractedPaths, OverARoof) {
  const double d = 20, h = 8, elevation = radians(15);
  const double excess = std::hypot(d, h) - (d * std::cos(elevation) + h * std::sin(elevation));
  const propagation::SatellitePaths satellite =
      World(house(), edges_only()).trace({0, 0, 2}, direction(0, 15));
  EXPECT_EQ(satellite.visibility, propagation::Visibility::NLOS);
  ASSERT_EQ(satellite.paths.size(), 1u);
  const propagation::Path& path = satellite.paths[0];
  EXPECT_EQ(path.kind, propagation::PathKind::Diffracted);
  EXPECT_EQ(path.order, 0);
  EXPECT_NEAR(path.excess_m, excess, 1e-9);
  EXPECT_NEAR(*path.edge_nu, 2 * std::sqrt(excess / wavelength_m(kL1)), 1e-6);
  EXPECT_NEAR(path.arrival_elevation_rad, std::atan2(h, d), 1e-9);
  EXPECT_EQ(path.incidence_count, 0);
  EXPECT_NE(path.reflector, 0u);
  EXPECT_EQ(satellite.tracked_excess_m(), path.excess_m);
  // As weak as by P.526, on this carrier and on another.
  for (const double frequency : {kL1, 1207.14e6}) {
    const double nu = 2 * std::sqrt(excess / wavelength_m(frequency));
    const double amplitude = std::abs(path_amplitude(path, elevation, frequency, isotropic_antenna()));
    EXPECT_NEAR(-20 * std::log10(amplitude), propagation::test::exact_knife_edge_loss_db(nu), 1e-6);
  }
}

// Through the shadow boundary at atan(8 / 20) = 21.80 deg: the sum of direct and edge wave is continuous,
// over the whole clear range of the options.
TEST(DiffractedPaths, FieldIsContinuousAtTheShadowBoundary) {
  const World world(house(), edges_only());
  const auto field = [&](double elevation_deg) {
    Complex sum = 0;
    for (const propagation::Path& path : world.trace({0, 0, 2}, direction(0, elevation_deg)).paths)
      sum += path_amplitude(path, radians(elevation_deg), kL1, isotropic_antenna());
    return sum;
  };
  const double boundary = std::atan2(8.0, 20.0) * 180 / geodesy::kPi;
  EXPECT_LT(std::abs(field(boundary - 0.02) - field(boundary + 0.02)), 0.02);
  EXPECT_NEAR(std::abs(field(boundary + 0.02)), 0.5, 0.01);
  const propagation::SatellitePaths lit = world.trace({0, 0, 2}, direction(0, boundary + 3));
  EXPECT_EQ(lit.visibility, propagation::Visibility::LOS);
  ASSERT_EQ(lit.paths.size(), 2u);
  EXPECT_EQ(lit.paths[0].kind, propagation::PathKind::Direct);
  EXPECT_EQ(lit.paths[1].kind, propagation::PathKind::Diffracted);
  EXPECT_LT(*lit.paths[1].edge_nu, 0);
  EXPECT_EQ(lit.tracked_excess_m(), 0);
  // Every field from shadow to light against F(nu); beyond nu = -2 the direct path alone.
  for (double deg = boundary - 12; deg < boundary + 12; deg += 0.37) {
    const double elevation = radians(deg);
    const double excess = std::hypot(20, 8) - (20 * std::cos(elevation) + 8 * std::sin(elevation));
    const double nu =
        propagation::signed_knife_edge_nu(std::max(0.0, excess), wavelength_m(kL1), deg < boundary);
    const Complex expected = nu < -2 ? 1.0 : propagation::knife_edge_field(nu);
    EXPECT_LT(std::abs(field(deg) - expected), 1e-6) << deg;
  }
  // The step at the end of that is 0.11; at P.526's -0.78 it would be 0.24.
  EXPECT_NEAR(std::abs(propagation::edge_wave(-2)), 0.11, 0.005);
  EXPECT_NEAR(std::abs(propagation::edge_wave(-0.78)), 0.24, 0.005);
}

TEST(DiffractedPaths, HaveTheImageAndTheReflectorOfTheirEdge) {
  const World world(house(), edges_only());
  const Vector3d antenna(0, 0, 2), velocity(3, -2, 0.5);
  const Vector3d s = direction(25, 12), angular_rate = 1e-4 * (Vector3d::UnitZ() - s.z() * s).eval();
  const auto at = [&](double t) {
    return paths_of_kind(world.trace(antenna + t * velocity, (s + t * angular_rate).normalized()),
                         propagation::PathKind::Diffracted)
        .at(0);
  };
  const propagation::Path path = at(0);
  const Vector3d image = antenna_image(path, antenna, s);
  EXPECT_NEAR(s.dot(antenna - image), path.excess_m, 1e-9);
  const double rate = angular_rate.dot(antenna - image) + (s - path.arrival).dot(velocity);
  EXPECT_NEAR((at(0.01).excess_m - at(-0.01).excess_m) / 0.02, rate, 1e-6);
  EXPECT_GT(std::abs(rate), 0.05);
  // The satellite's part separately.
  const auto resting = [&](double t) {
    return paths_of_kind(world.trace(antenna, (s + t * angular_rate).normalized()),
                         propagation::PathKind::Diffracted)
        .at(0)
        .excess_m;
  };
  const double rotation_rate = angular_rate.dot(antenna - image);
  EXPECT_NEAR((resting(1) - resting(-1)) / 2, rotation_rate, 1e-7);
  EXPECT_GT(std::abs(rotation_rate), 1e-4);
  EXPECT_EQ(at(2).reflector, path.reflector);
  EXPECT_NE(at(2).point, path.point);
}

// ---- diffuse

propagation::PropagationOptions diffuse_only() {
  propagation::PropagationOptions options = order(0);
  options.diffuse = true;
  return options;
}

TEST(DiffusePaths, AreThoseOfTheScattering) {
  const propagation::PropagationOptions options = diffuse_only();
  const World world(street(), options);
  const propagation::DiffuseScattering scattering(world.mesh, world.scene, options.scattering);
  const Vector3d antenna(3, -10, 2);
  const std::vector<Vector3d> sky{direction(170, 30), direction(10, 80)};
  std::vector<propagation::SatellitePaths> result(2);
  world.propagator.trace(antenna, sky, result);
  EXPECT_EQ(result[0].visibility, propagation::Visibility::NLOS);
  EXPECT_EQ(result[1].visibility, propagation::Visibility::LOS);
  std::vector<std::vector<propagation::DiffusePath>> expected(2);
  const std::array<bool, 2> wanted{true, true};
  scattering.trace(antenna, sky, wanted, expected);
  ASSERT_GT(expected[0].size(), 1u);
  ASSERT_EQ(result[0].paths.size(), expected[0].size());
  EXPECT_EQ(result[1].paths.size(), 1 + expected[1].size()) << "behind the direct path";
  std::set<std::uint64_t> reflectors;
  for (std::size_t i = 0; i < expected[0].size(); ++i) {
    const propagation::Path& path = result[0].paths[i];
    EXPECT_EQ(path.kind, propagation::PathKind::Diffuse);
    EXPECT_EQ(path.order, 0);
    EXPECT_EQ(path.excess_m, expected[0][i].excess_m);
    EXPECT_EQ(path.scattered_power, expected[0][i].power);
    EXPECT_EQ(path.point, expected[0][i].point);
    EXPECT_EQ(path.arrival, expected[0][i].arrival);
    EXPECT_EQ(path.triangle, expected[0][i].triangle);
    EXPECT_NEAR(path.arrival_elevation_rad, std::asin(path.arrival.z()), 1e-12);
    EXPECT_TRUE(reflectors.insert(path.reflector).second) << "one for each class";
    // Isotropic for RHCP, no response to LHCP: half of the power.
    EXPECT_NEAR(std::norm(path_amplitude(path, radians(30), kL1, isotropic_antenna())) / path.scattered_power,
                0.5, 1e-9);
  }
}

// The path over a fixed point: |P - A| - s.(P - A).
TEST(DiffusePaths, HaveTheImageOfTheirPoint) {
  propagation::PropagationOptions options = diffuse_only();
  options.scattering.bounces = 1;
  const World world(street(), options);
  const Vector3d antenna(3, -10, 2), s = direction(170, 30), velocity(4, 1, 0.2);
  const Vector3d rotation_rate = 1e-4 * s.cross(Vector3d(0.3, 0.5, 0.8)).eval();
  const propagation::SatellitePaths satellite = world.trace(antenna, s);
  ASSERT_FALSE(satellite.paths.empty());
  for (const propagation::Path& path : satellite.paths) {
    const auto detour = [&](double t) {
      const Vector3d leg = path.point - (antenna + t * velocity);
      return leg.norm() - (s + t * rotation_rate).normalized().dot(leg);
    };
    const Vector3d image = antenna_image(path, antenna, s);
    EXPECT_NEAR(s.dot(antenna - image), detour(0), 1e-9);
    EXPECT_NEAR(rotation_rate.dot(antenna - image) + (s - path.arrival).dot(velocity),
                (detour(0.01) - detour(-0.01)) / 0.02, 1e-5);
    EXPECT_NEAR(detour(0), path.excess_m, 10) << "the width of a class";
  }
}

// P_specular + P_scattered = P_smooth: walls and vehicles keep 1 - S^2, the ground all.
TEST(DiffusePaths, WallsReflectWhatTheyDoNotScatter) {
  Mesh mesh = street();
  city::append_object(mesh, "ground", Surface::Terrain, Material::Ground,
                      {{-200, -15, 0}, {200, -15, 0}, {200, 15, 0}, {-200, 15, 0}}, {{0, 1, 2}, {0, 2, 3}});
  propagation::PropagationOptions options = everything();
  options.scattering.scattering_coefficient = 0.6;
  int walls = 0, grounds = 0;
  for (const bool diffuse : {true, false}) {
    options.diffuse = diffuse;
    const propagation::SatellitePaths satellite = World(mesh, options).trace({3, -2, 2}, direction(200, 65));
    for (const propagation::Path& path : satellite.paths) {
      for (int i = 0; i < path.incidence_count; ++i) {
        const propagation::Incidence& incidence = path.incidences[static_cast<std::size_t>(i)];
        const bool ground = incidence.material == Material::Ground;
        EXPECT_NEAR(incidence.specular_factor, diffuse && !ground ? 0.8 : 1, 1e-12);  // sqrt(1 - 0.36)
        (ground ? grounds : walls) += 1;
      }
    }
  }
  EXPECT_GT(walls, 2);
  EXPECT_GT(grounds, 1);
}

// ---- vegetation

propagation::PropagationOptions through_foliage() {
  propagation::PropagationOptions options;
  options.through_foliage = true;
  return options;
}
void append_tree(Mesh& mesh, const Vector3d& min, const Vector3d& max) {
  append(mesh, min, max, Material::Foliage, Surface::Foliage);
}

TEST(ThroughFoliage, TheDirectPathIsWeakened) {
  Mesh mesh;
  append_tree(mesh, {-50, 20, 0}, {50, 30, 50});
  append_tree(mesh, {-40, 22, 0}, {40, 25, 40});  // in the first one
  append_tree(mesh, {-50, 30, 0}, {50, 34, 50});  // touches it
  append_tree(mesh, {-50, 60, 0}, {50, 61, 50});
  const Vector3d antenna(0.2, 0, 2), s = direction(0, 20);
  EXPECT_EQ(World(mesh).trace(antenna, s).visibility, propagation::Visibility::Blocked);
  const World world(mesh, through_foliage());
  const propagation::SatellitePaths satellite = world.trace(antenna, s);
  EXPECT_EQ(satellite.visibility, propagation::Visibility::LOS);
  ASSERT_EQ(satellite.paths.size(), 1u);
  const propagation::Path& path = satellite.paths[0];
  EXPECT_EQ(path.kind, propagation::PathKind::Direct);
  EXPECT_EQ(path.excess_m, 0);
  EXPECT_EQ(path.reflector, 0u);
  const double depth = 15 / std::cos(radians(20));  // y from 20 to 34 and from 60 to 61
  EXPECT_NEAR(path.foliage_depth_m, depth, 1e-9);
  EXPECT_NEAR(-20 * std::log10(std::abs(path_amplitude(path, radians(20), kL1, patch_antenna()))),
              foliage_loss_db(FoliageModel::Woodland, depth, kL1, radians(20)), 1e-9);
  EXPECT_EQ(world.trace(antenna, direction(180, 20)).paths.at(0).foliage_depth_m, 0);
  // From under the crown, its floor is behind.
  EXPECT_NEAR(world.trace({0.2, 24, 3}, direction(0, 90)).paths.at(0).foliage_depth_m, 47, 1e-9);
}

TEST(ThroughFoliage, AnythingElseInTheWayBlocks) {
  for (const double y : {10.0, 24.0, 40.0}) {  // before, in and behind the wood
    Mesh mesh;
    append_tree(mesh, {-50, 20, 0}, {50, 30, 50});
    append(mesh, {-50, y, 0}, {50, y + 2, 50});
    const World world(mesh, through_foliage());
    EXPECT_EQ(world.trace({0.2, 0, 2}, direction(0, 20)).visibility, propagation::Visibility::Blocked) << y;
  }
}

TEST(ThroughFoliage, ReflectionsAreStillBlocked) {
  Mesh mesh;
  append(mesh, {-200, 15, 0}, {200, 30, 60});
  const Vector3d antenna(0, 0, 2), s = direction(180, 30);
  EXPECT_EQ(World(mesh, through_foliage()).trace(antenna, s).paths.size(), 2u);
  append_tree(mesh, {-50, 8, 0}, {50, 9, 40});
  const propagation::SatellitePaths hidden = World(mesh, through_foliage()).trace(antenna, s);
  EXPECT_EQ(hidden.visibility, propagation::Visibility::LOS);
  append_tree(mesh, {-50, -9, 0}, {50, -8, 40});
  const propagation::SatellitePaths satellite = World(mesh, through_foliage()).trace(antenna, s);
  ASSERT_EQ(satellite.paths.size(), 1u);
  EXPECT_NEAR(satellite.paths[0].foliage_depth_m, 1 / std::cos(radians(30)), 1e-9);
}

TEST(ThroughFoliage, MovableTreesAndCards) {
  Mesh tree;
  append_tree(tree, {-3, -2, 0}, {3, 2, 8});
  Mesh card;
  city::append_object(card, "card", Surface::Foliage, Material::Foliage,
                      {{-50, 30, 0}, {50, 30, 0}, {50, 30, 60}, {-50, 30, 60}}, {{0, 1, 2}, {0, 2, 3}});
  RayScene scene(card);
  const auto id = scene.add_instance(tree);
  scene.set_pose(id, Isometry3d(Eigen::Translation3d(0, 10, 0) *
                                Eigen::AngleAxisd(geodesy::kPi / 2, Vector3d::UnitZ())));
  scene.commit();
  const propagation::Propagator propagator(card, scene, through_foliage());
  const Vector3d s = direction(0, 10);
  propagation::SatellitePaths satellite;
  propagator.trace({0.3, 0, 2}, {&s, 1}, {&satellite, 1});
  ASSERT_EQ(satellite.visibility, propagation::Visibility::LOS);
  EXPECT_NEAR(satellite.paths.at(0).foliage_depth_m, 6 / std::cos(radians(10)), 1e-9)
      << "turned: 6 m deep; the card has no depth";
}

// ---- all together

TEST(Everything, IsInOrderAndTellsItsStrength) {
  const city::City city = city::synthetic_city({});
  const World world(city.mesh, everything());
  std::vector<Vector3d> sky;
  for (int i = 0; i < 40; ++i) sky.push_back(geodesy::enu_from_azimuth_elevation(0.7 * i, 0.1 + 0.035 * i));
  std::array<int, 4> kinds{};
  const AntennaPattern antenna = patch_antenna();
  for (double along = -100; along < 100; along += 5) {
    std::vector<propagation::SatellitePaths> result(sky.size());
    world.propagator.trace({along, 0.3, 2}, sky, result);
    for (std::size_t i = 0; i < sky.size(); ++i) {
      const std::vector<propagation::Path>& paths = result[i].paths;
      for (std::size_t k = 0; k < paths.size(); ++k) {
        const propagation::Path& path = paths[k];
        kinds[static_cast<std::size_t>(path.kind)] += 1;
        EXPECT_EQ(path.kind == propagation::PathKind::Direct,
                  k == 0 && result[i].visibility != propagation::Visibility::NLOS);
        if (k > 0) {
          EXPECT_GE(path.excess_m, paths[k - 1].excess_m);
        }
        EXPECT_EQ(path.incidence_count, path.order);
        EXPECT_NEAR(path.arrival.norm(), 1, 1e-9);
        EXPECT_NEAR(path.arrival_elevation_rad, std::asin(path.arrival.z()), 1e-9);
        EXPECT_EQ(path.reflector == 0, path.kind == propagation::PathKind::Direct);
        const double power = std::norm(path_amplitude(path, std::asin(sky[i].z()), kL1, antenna));
        EXPECT_TRUE(power >= 0 && power < 10) << power;
      }
      const bool reflected = !paths_of_kind(result[i], propagation::PathKind::Reflected).empty();
      if (!paths.empty() && paths[0].kind == propagation::PathKind::Direct) {
        EXPECT_EQ(result[i].visibility,
                  reflected ? propagation::Visibility::LOSMultipath : propagation::Visibility::LOS);
      } else {
        EXPECT_EQ(result[i].visibility,
                  paths.empty() ? propagation::Visibility::Blocked : propagation::Visibility::NLOS);
      }
    }
  }
  for (const int count : kinds) EXPECT_GT(count, 50);
}

TEST(Everything, NamesWhatIsWrong) {
  propagation::PropagationOptions options;
  options.edges.max_range_m = 0;
  EXPECT_THROW(options.validate(), InputError);
  options = {};
  options.scattering.scattering_coefficient = 1.5;
  EXPECT_THROW(options.validate(), InputError);
  EXPECT_EQ(propagation::PropagationOptions{}, propagation::PropagationOptions{});
}

}  // namespace
}  // namespace canyon::signal::propagator_paths_test
