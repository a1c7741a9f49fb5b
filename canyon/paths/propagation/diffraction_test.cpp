#include "canyon/paths/propagation/diffraction.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/paths/propagation/index/knife_edge.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/spoiled_options.hpp"

namespace canyon::propagation {
namespace {

using city::Material;
using city::Mesh;
using city::Surface;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using geodesy::kPi;
using geodesy::radians;
using raytrace::RayScene;

constexpr double kWavelength = geodesy::kSpeedOfLight / 1575.42e6;

/// Towards a satellite, azimuth from north clockwise.
Vector3d direction(double azimuth_deg, double elevation_deg) {
  return geodesy::enu_from_azimuth_elevation(radians(azimuth_deg), radians(elevation_deg));
}

void append(Mesh& mesh, const Vector3d& min, const Vector3d& max, double yaw_rad = 0) {
  canyon::test::append_box(mesh, "box", Surface::Building, Material::Concrete, min, max, yaw_rad);
}

/// A rectangle from `corner` along `u` and `v`; its front is to the side of u x v.
void append_sheet(Mesh& mesh, const Vector3d& corner, const Vector3d& u, const Vector3d& v) {
  city::append_object(mesh, "sheet", Surface::Building, Material::Concrete,
                      {corner, corner + u, corner + u + v, corner + v}, {{0, 1, 2}, {0, 2, 3}});
}

/// All existing paths, of any strength.
DiffractionOptions everything() {
  DiffractionOptions options;
  options.max_loss_db = 100;
  options.max_bending_rad = kPi;
  options.max_paths = 100;
  options.max_clear_nu = 0.78;
  return options;
}

struct World {
  RayScene scene;
  EdgeDiffraction diffraction;

  explicit World(const Mesh& mesh, const DiffractionOptions& options = everything())
      : scene(mesh), diffraction(mesh, scene, options) {}
  [[nodiscard]] bool blocked(const Vector3d& antenna, const Vector3d& s) const {
    return scene.occluded({antenna, s}, scene.surface_offset_m(antenna));
  }
  [[nodiscard]] std::vector<DiffractedPath> trace(const Vector3d& antenna, const Vector3d& s) const {
    const bool hidden = blocked(antenna, s);
    std::vector<DiffractedPath> paths;
    diffraction.trace(antenna, {&s, 1}, {&hidden, 1}, {&paths, 1});
    return paths;
  }
};

// ---- loss

TEST(EdgeDiffraction, LosesWhatAHalfPlaneDoesAndNearlyWhatARightAngleDoes) {
  // Keller's coefficient without the term of the reflection, which circular polarisation cancels in the
  // copolar part (the mean of soft and hard): D = sin(pi / n) / n / (cos(pi / n) - cos(turn / n)) / sqrt(2 pi
  // k), n pi the air around the edge, turn = pi + bending (Kouyoumjian and Pathak 1974, equation 33). The
  // field spreads as 1 / sqrt(distance).
  const double k = 2 * kPi / kWavelength, distance = 30;
  const auto keller_loss_db = [&](double n, double bending) {
    const double d = std::sin(kPi / n) / n / (std::cos(kPi / n) - std::cos((kPi + bending) / n));
    return -20 * std::log10(std::abs(d) / std::sqrt(2 * kPi * k * distance));
  };
  for (const double bending_deg : {10.0, 20.0, 30.0, 45.0, 60.0}) {
    const double bending = radians(bending_deg);
    const double excess = distance * (1 - std::cos(bending));
    const double loss = approximate_knife_edge_loss_db(signed_knife_edge_nu(excess, kWavelength, true));
    EXPECT_NEAR(loss, keller_loss_db(2, bending), 0.13) << bending_deg;
    const double more = loss - keller_loss_db(1.5, bending);
    std::printf("bent by %g deg the knife edge loses %.2f dB more than a right angle\n", bending_deg, more);
    EXPECT_GT(more, 0);
    EXPECT_LT(more, 2.4);
  }
}

// ---- closed forms

TEST(EdgeDiffraction, OverARoof) {
  Mesh mesh;
  append(mesh, {-500, 10, 0}, {500, 30, 22});
  const World world(mesh);
  const Vector3d antenna(3, 0, 2);
  const double d = 10, h = 20;
  for (double elevation_deg = 1; elevation_deg < 63.4; elevation_deg += 2) {
    const auto paths = world.trace(antenna, direction(0, elevation_deg));
    ASSERT_GE(paths.size(), 1u) << elevation_deg;
    const DiffractedPath& path = paths.front();
    const double e = radians(elevation_deg);
    EXPECT_NEAR(path.excess_m, std::hypot(d, h) - (d * std::cos(e) + h * std::sin(e)), 1e-9);
    EXPECT_NEAR((path.point - Vector3d(3, 10, 22)).norm(), 0, 1e-9);
    EXPECT_NEAR((path.arrival - Vector3d(0, d, h).normalized()).norm(), 0, 1e-12);
    EXPECT_NEAR(path.bending_rad, std::atan2(h, d) - e, 1e-12);
    EXPECT_NEAR(path.nu, 2 * std::sqrt(path.excess_m / kWavelength), 1e-9);
    EXPECT_EQ(path.loss_db, approximate_knife_edge_loss_db(path.nu));
    EXPECT_EQ(path.instance, 0u);
    const Edge& edge = world.diffraction.edges().edges()[path.edge];
    EXPECT_NEAR(std::abs(edge.direction.x()), 1, 1e-12);
    EXPECT_NEAR(edge.start.z(), 22, 1e-12);
  }
}

TEST(EdgeDiffraction, AroundAVerticalCorner) {
  // A tower; the satellite behind its western corner.
  Mesh mesh;
  append(mesh, {2, 15, 0}, {48, 55, 300});
  const World world(mesh);
  const Vector3d antenna(8, -5, 2);  // 6 m east and 20 m south of the corner
  const double rho = std::hypot(6, 20), corner_azimuth = std::atan2(-6, 20);
  for (const double elevation_deg : {5.0, 25.0, 50.0, 70.0}) {
    for (const double azimuth_deg : {-15.0, -10.0, -5.0, -1.0}) {
      const double e = radians(elevation_deg), rotation = radians(azimuth_deg) - corner_azimuth;
      const auto paths = world.trace(antenna, direction(azimuth_deg, elevation_deg));
      const auto corner = std::find_if(paths.begin(), paths.end(), [](const DiffractedPath& p) {
        return std::abs(p.point.x() - 2) < 1e-6;
      });
      ASSERT_NE(corner, paths.end());
      EXPECT_NEAR(corner->excess_m, rho * std::cos(e) * (1 - std::cos(rotation)), 1e-9);
      EXPECT_NEAR((corner->point - Vector3d(2, 15, 2 + rho * std::tan(e))).norm(), 0, 1e-9);
      EXPECT_NEAR((corner->arrival - direction(geodesy::degrees(corner_azimuth), elevation_deg)).norm(), 0,
                  1e-12);
      EXPECT_GT(corner->nu, 0);
    }
  }
}

TEST(EdgeDiffraction, OverTheTopOfASheet) {
  Mesh mesh;
  append_sheet(mesh, {-50, 10, 0}, {100, 0, 0}, {0, 0, 22});
  const World world(mesh);
  // The same holds from its front and its back.
  for (const double side : {1.0, -1.0}) {
    const auto paths = world.trace({0, 10 - 10 * side, 2}, direction(side > 0 ? 0 : 180, 40));
    ASSERT_GE(paths.size(), 1u);
    const double e = radians(40);
    EXPECT_NEAR(paths[0].excess_m, std::hypot(10, 20) - (10 * std::cos(e) + 20 * std::sin(e)), 1e-9);
    // Its sides are 50 m away, with longer detours.
    for (std::size_t i = 1; i < paths.size(); ++i) EXPECT_GT(paths[i].excess_m, 10);
  }
}

TEST(EdgeDiffraction, IsContinuousAtTheShadowBoundary) {
  Mesh mesh;
  append(mesh, {-500, 10, 0}, {500, 30, 22});
  const World world(mesh);
  const Vector3d antenna(3, 0, 2);
  const double boundary = geodesy::degrees(std::atan2(20, 10));
  for (const double off_deg : {1.0, 0.1, 0.01, 1e-3}) {
    const auto dark = world.trace(antenna, direction(0, boundary - off_deg));
    const auto light = world.trace(antenna, direction(0, boundary + off_deg));
    ASSERT_TRUE(world.blocked(antenna, direction(0, boundary - off_deg)));
    ASSERT_FALSE(world.blocked(antenna, direction(0, boundary + off_deg)));
    ASSERT_EQ(dark.size(), 1u);
    ASSERT_EQ(light.size(), 1u);
    const double excess = std::hypot(10, 20) * (1 - std::cos(radians(off_deg)));
    EXPECT_NEAR(dark[0].excess_m, excess, 1e-9);
    EXPECT_NEAR(light[0].excess_m, excess, 1e-9);
    EXPECT_NEAR(dark[0].nu, -light[0].nu, 1e-6);
    EXPECT_GT(dark[0].nu, 0);
    EXPECT_GT(dark[0].loss_db, approximate_knife_edge_loss_db(0));
    EXPECT_LT(light[0].loss_db, approximate_knife_edge_loss_db(0));
    // J's slope at 0; the remainder is of third order.
    const double slope = 20 / std::log(10) / std::sqrt(1.01);
    EXPECT_NEAR(dark[0].loss_db - light[0].loss_db, 2 * slope * dark[0].nu,
                3 * std::pow(dark[0].nu, 3) + 1e-9);
  }
  // |nu| = 0.78 is 3 deg above the boundary here; beyond it the edge has no effect.
  const double bound =
      geodesy::degrees(2 * std::asin(0.78 * std::sqrt(kWavelength / 8 / std::hypot(10, 20))));
  EXPECT_EQ(world.trace(antenna, direction(0, boundary + bound - 0.01)).size(), 1u);
  EXPECT_EQ(world.trace(antenna, direction(0, boundary + bound + 0.01)).size(), 0u);
  // The edge counts farther out if the options allow it.
  DiffractionOptions further = everything();
  further.max_clear_nu = 2;
  const auto beyond = World(mesh, further).trace(antenna, direction(0, boundary + bound + 0.01));
  ASSERT_EQ(beyond.size(), 1u);
  EXPECT_NEAR(beyond[0].nu, -0.78, 0.01);
  EXPECT_EQ(beyond[0].loss_db, 0);
}

// ---- symmetries

/// A block with a yard, a tower and a slab, as a scene without symmetry, rotated about the vertical.
Mesh quarter(double yaw_rad) {
  Mesh mesh;
  const auto rotated = [&](const Vector3d& middle, const Vector3d& size, double host_yaw) {
    const Vector3d at = Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()) * middle;
    append(mesh, at - 0.5 * size, at + 0.5 * size, host_yaw + yaw_rad);
  };
  rotated({0, 30, 10}, {50, 12, 20}, 0.1);
  rotated({-30, -5, 20}, {14, 18, 40}, -0.4);
  rotated({25, -20, 7}, {20, 30, 14}, 0.7);
  rotated({5, 70, 25}, {30, 10, 50}, 0.3);
  return mesh;
}

TEST(EdgeDiffraction, TurnsWithTheScene) {
  const World reference(quarter(0));
  std::size_t found = 0;
  for (const double yaw : {0.5, 2.1, -1.3}) {
    const World world(quarter(yaw));
    const Eigen::Matrix3d rotation = Eigen::AngleAxisd(yaw, Vector3d::UnitZ()).toRotationMatrix();
    std::mt19937 random(3);
    std::uniform_real_distribution<double> coordinate(-8, 8), azimuth(0, 360), elevation(2, 80);
    for (int i = 0; i < 100; ++i) {
      const Vector3d antenna(coordinate(random), coordinate(random), 2),
          s = direction(azimuth(random), elevation(random));
      const auto expected = reference.trace(antenna, s),
                 paths = world.trace(rotation * antenna, rotation * s);
      ASSERT_EQ(paths.size(), expected.size());
      for (std::size_t k = 0; k < paths.size(); ++k) {
        EXPECT_NEAR(paths[k].excess_m, expected[k].excess_m, 1e-9);
        EXPECT_NEAR(paths[k].nu, expected[k].nu, 1e-6);
        EXPECT_NEAR((paths[k].point - rotation * expected[k].point).norm(), 0, 1e-9);
        ++found;
      }
    }
  }
  EXPECT_GT(found, 200u);
}

TEST(EdgeDiffraction, IsReciprocal) {
  // An antenna on the path from the edge to the satellite, for a satellite back along the leg, finds the same
  // edge at the same point, with equal bending.
  const World world(quarter(0));
  std::mt19937 random(4);
  std::uniform_real_distribution<double> coordinate(-8, 8), azimuth(0, 360), elevation(2, 80);
  std::size_t compared = 0;
  for (int i = 0; i < 300; ++i) {
    const Vector3d antenna(coordinate(random), coordinate(random), 2),
        s = direction(azimuth(random), elevation(random));
    if (!world.blocked(antenna, s)) continue;
    for (const DiffractedPath& path : world.trace(antenna, s)) {
      const Vector3d beyond = path.point + 200 * s, back = -path.arrival;
      // In reverse the ray does not end at the antenna; it may soon hit a surface beyond it.
      if (world.scene.occluded({antenna, back}) || !world.blocked(beyond, back)) continue;
      const auto returned = world.trace(beyond, back);
      const auto same = std::find_if(returned.begin(), returned.end(), [&](const DiffractedPath& p) {
        return (p.point - path.point).norm() < 1e-6;
      });
      ASSERT_NE(same, returned.end());
      EXPECT_EQ(same->edge, path.edge);
      EXPECT_NEAR(same->bending_rad, path.bending_rad, 1e-9);
      EXPECT_NEAR(same->excess_m / 200, path.excess_m / (path.point - antenna).norm(), 1e-9);
      EXPECT_EQ(same->nu > 0, path.nu > 0);
      ++compared;
    }
  }
  std::printf("compared %zu paths\n", compared);
  EXPECT_GT(compared, 20u);
}

// ---- obstacles

TEST(EdgeDiffraction, NoPathThroughAnythingElse) {
  Mesh mesh;
  append(mesh, {-500, 10, 0}, {500, 30, 22});
  const Vector3d antenna(3, 0, 2), s = direction(0, 40);
  const auto over = [](const std::vector<DiffractedPath>& paths) {
    return std::any_of(paths.begin(), paths.end(),
                       [](const DiffractedPath& p) { return (p.point - Vector3d(3, 10, 22)).norm() < 1e-6; });
  };
  ASSERT_TRUE(over(World(mesh).trace(antenna, s)));
  {  // in the path to the satellite: at y = 100 the ray from the roof is 97.5 m high
    Mesh high = mesh, low = mesh;
    append(high, {-20, 100, 0}, {20, 110, 98});
    append(low, {-20, 100, 0}, {20, 110, 97});
    EXPECT_FALSE(over(World(high).trace(antenna, s)));
    EXPECT_TRUE(over(World(low).trace(antenna, s)));
  }
  {  // in the path to the antenna: half way up the ray is at y = 5, z = 12
    Mesh sign = mesh, neighbour = mesh;
    append(sign, {2, 4.9, 11}, {4, 5.1, 13});
    append(neighbour, {3.1, 4.9, 11}, {4, 5.1, 13});
    EXPECT_FALSE(over(World(sign).trace(antenna, s)));
    EXPECT_TRUE(over(World(neighbour).trace(antenna, s)));
  }
  {  // foliage blocks and does not diffract
    Mesh tree = mesh;
    canyon::test::append_box(tree, "tree", Surface::Foliage, Material::Foliage, {2, 4, 11}, {4, 6, 13});
    EXPECT_FALSE(over(World(tree).trace(antenna, s)));
  }
}

TEST(EdgeDiffraction, LegsOfRandomPathsAreClear) {
  // By first hits, with a millimetre's margin: in a city of 1.3 km the lift off an edge is about 1 mm.
  const city::City city = city::synthetic_city({});
  const World world(city.mesh);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> coordinate(-200, 200), azimuth(0, 360), elevation(5, 80);
  std::size_t paths_found = 0, hidden = 0;
  for (int i = 0; i < 400; ++i) {
    const Vector3d antenna(i % 2 == 0 ? coordinate(random) : 0.3, i % 2 == 0 ? 0.3 : coordinate(random), 2);
    const Vector3d s = direction(azimuth(random), elevation(random));
    hidden += world.blocked(antenna, s) ? 1 : 0;
    for (const DiffractedPath& path : world.trace(antenna, s)) {
      ++paths_found;
      const double range = (path.point - antenna).norm();
      const auto hit = world.scene.cast({antenna, path.arrival});
      if (hit) {
        EXPECT_GT(hit->range_m, range - 0.02);
      }
      const Edge& edge = world.diffraction.edges().edges()[path.edge];
      EXPECT_FALSE(world.scene.occluded({path.point + 0.01 * edge.outward(), s}, 0.02));
      EXPECT_NEAR(path.excess_m, range - s.dot(path.point - antenna), 1e-9);
    }
  }
  std::printf("%zu of 400 hidden, %zu paths\n", hidden, paths_found);
  EXPECT_GT(paths_found, 100u);
}

/// Rotates by an angle that gives no round coordinates.
Vector3d askew(const Vector3d& v) {
  return Eigen::AngleAxisd(0.5432, Vector3d::UnitZ()) * v;
}

/// A wall of 200 m and 40 m height at y = 10, all askew; its sheets have no common edges: cuts look like free
/// edges.
void append_wall_in_pieces(Mesh& mesh) {
  for (int i = 0; i < 20; ++i) {
    append_sheet(mesh, askew({-100.0 + 10 * i, 10, -1.0 - i % 2}), askew({10, 0, 0}), {0, 0, 16.0 + i % 2});
  }
  append_sheet(mesh, askew({-100, 10, 15}), askew({200, 0, 0}), {0, 0, 25});
}

/// Whether a path passes through or along append_wall_in_pieces() other than around its outline.
bool at_a_cut(const DiffractedPath& path) {
  const Vector3d point = Eigen::AngleAxisd(-0.5432, Vector3d::UnitZ()) * path.point;
  return std::abs(point.y() - 10) < 1e-6 && point.z() < 40 - 1e-6 && std::abs(point.x()) < 100 - 1e-6;
}

TEST(EdgeDiffraction, ACutThroughAWallLetsNothingThrough) {
  Mesh mesh;
  append_wall_in_pieces(mesh);
  const World world(mesh);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> coordinate(-50, 50), azimuth(-70, 70), elevation(2, 60);
  std::size_t hidden = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d antenna = askew({coordinate(random), 0, 2}),
                   s = askew(direction(azimuth(random), elevation(random)));
    if (!world.blocked(antenna, s)) continue;
    ++hidden;
    for (const DiffractedPath& path : world.trace(antenna, s)) {
      EXPECT_FALSE(at_a_cut(path)) << path.point.transpose();
    }
  }
  EXPECT_GT(hidden, 500u);
}

TEST(EdgeDiffraction, ACutThroughAWallScattersNothing) {
  // The same wall along its length, satellites in front of it hidden by a sign: legs to the cuts are clear.
  Mesh mesh;
  append_wall_in_pieces(mesh);
  append_sheet(mesh, askew({1, -1, 0}), askew({0, 2, 0}), {0, 0, 30});
  const World world(mesh);
  for (double elevation_deg = 2; elevation_deg < 60; elevation_deg += 0.3) {
    const Vector3d antenna = askew({0.3, 0, 2}), s = askew(direction(95, elevation_deg));
    ASSERT_TRUE(world.blocked(antenna, s));
    for (const DiffractedPath& path : world.trace(antenna, s)) {
      EXPECT_FALSE(at_a_cut(path)) << path.point.transpose();
    }
  }
}

TEST(EdgeDiffraction, AnEdgeDrawnTwiceGivesOnePath) {
  // A wall in pieces below a roof in one piece: only the ends are common vertices, two free edges at one
  // place.
  Mesh mesh;
  for (int i = 0; i < 3; ++i) append_sheet(mesh, {-30.0 + 20 * i, 10, 0}, {20, 0, 0}, {0, 0, 22});
  append_sheet(mesh, {-30, 10, 22}, {60, 0, 0}, {0, 20, 0});
  const World world(mesh);
  const Vector3d antenna(3, 0, 2);
  const auto paths = world.trace(antenna, direction(0, 40));
  EXPECT_EQ(std::count_if(paths.begin(), paths.end(),
                          [](const DiffractedPath& p) { return std::abs(p.point.z() - 22) < 1e-6; }),
            1);
  const double e = radians(40);
  ASSERT_GE(paths.size(), 1u);
  EXPECT_NEAR(paths[0].excess_m, std::hypot(10, 20) - (10 * std::cos(e) + 20 * std::sin(e)), 1e-9);
}

TEST(EdgeDiffraction, ASeamOfCoplanarWallsIsNoEdge) {
  // Two buildings of different height with one facade line: the tall one's corner is an edge only above the
  // low one. A sign hides satellites in front of the facade, so that edges next to the line count.
  Mesh mesh;
  append(mesh, {-20, 20, 0}, {0, 40, 40});
  append(mesh, {0, 20, 0}, {20, 40, 15});
  append_sheet(mesh, {-2.5, -3, 0}, {0, 6, 0}, {0, 0, 60});
  const World world(mesh);
  const Vector3d antenna(-3, 0, 2);
  const auto at_seam = [](const DiffractedPath& p) {
    return std::abs(p.point.x()) < 1e-6 && std::abs(p.point.y() - 20) < 1e-6;
  };
  for (double elevation_deg = 2; elevation_deg < 60; elevation_deg += 1) {
    const Vector3d s = direction(95, elevation_deg);
    ASSERT_TRUE(world.blocked(antenna, s));
    const auto paths = world.trace(antenna, s);
    // The cone's point, 20.2 m away; the sign's top does not block this leg.
    const double height = 2 + std::hypot(3, 20) * std::tan(radians(elevation_deg));
    if (std::abs(height - 15) < 0.1 || height > 39.9) continue;
    EXPECT_EQ(std::any_of(paths.begin(), paths.end(), at_seam), height > 15) << elevation_deg;
  }
}

TEST(EdgeDiffraction, AnEdgeBesideTheOneInTheWay) {
  // A sign hides the satellite; the end of a wall next to it, which does not block, scatters by |nu|.
  Mesh mesh;
  append_sheet(mesh, {-0.5, 5, 0}, {1, 0, 0}, {0, 0, 50});
  append(mesh, {3, 20, 0}, {60, 40, 50});
  const World world(mesh);
  const auto paths = world.trace({0, 0, 2}, direction(-2, 10));
  const auto wall = std::find_if(paths.begin(), paths.end(),
                                 [](const DiffractedPath& p) { return std::abs(p.point.x() - 3) < 1e-6; });
  ASSERT_NE(wall, paths.end());
  EXPECT_LT(wall->nu, 0);
  EXPECT_NEAR(wall->loss_db, approximate_knife_edge_loss_db(-wall->nu), 1e-12);
  // Around the sign on both sides.
  EXPECT_EQ(
      std::count_if(paths.begin(), paths.end(),
                    [](const DiffractedPath& p) { return std::abs(std::abs(p.point.x()) - 0.5) < 1e-6; }),
      2);
}

TEST(EdgeDiffraction, MovableThingsHaveEdges) {
  // A lorry next to the antenna, given in its own frame.
  Mesh lorry;
  canyon::test::append_box(lorry, "lorry", Surface::Vehicle, Material::Metal, {-6, -1.25, 0}, {6, 1.25, 4});
  const double yaw = 0.4;
  Isometry3d pose = Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(yaw, Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = Vector3d(1, 4, 0);
  RayScene scene{Mesh{}};
  const auto id = scene.add_instance(lorry);
  scene.set_pose(id, pose);
  scene.commit();
  const EdgeDiffraction diffraction(Mesh{}, scene, everything());

  Mesh still;
  canyon::test::append_box(still, "lorry", Surface::Vehicle, Material::Metal, {-5, 2.75, 0}, {7, 5.25, 4},
                           yaw);
  const World world(still);
  std::size_t found = 0;
  for (double azimuth = -40; azimuth < 40; azimuth += 7) {
    const Vector3d antenna(0.2, 0, 1.5), s = direction(azimuth, 20);
    const bool hidden = world.blocked(antenna, s);
    ASSERT_EQ(scene.occluded({antenna, s}), hidden);
    std::vector<DiffractedPath> paths;
    diffraction.trace(antenna, {&s, 1}, {&hidden, 1}, {&paths, 1});
    const auto expected = world.trace(antenna, s);
    ASSERT_EQ(paths.size(), expected.size());
    for (std::size_t k = 0; k < paths.size(); ++k) {
      EXPECT_EQ(paths[k].instance, id);
      EXPECT_NEAR(paths[k].excess_m, expected[k].excess_m, 1e-9);
      EXPECT_NEAR((paths[k].point - expected[k].point).norm(), 0, 1e-9);
      ++found;
    }
  }
  EXPECT_GT(found, 5u);
}

// ---- options

TEST(EdgeDiffraction, KeepsTheStrongestWithinItsLimits) {
  const Mesh mesh = quarter(0);
  const World all(mesh);
  DiffractionOptions few;
  few.max_paths = 2;
  few.max_clear_nu = 0.78;
  few.max_loss_db = 30;
  few.max_bending_rad = radians(40);
  few.max_range_m = 40;
  const World some(mesh, few);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> coordinate(-8, 8), azimuth(0, 360), elevation(2, 80);
  std::size_t kept = 0, dropped = 0;
  for (int i = 0; i < 300; ++i) {
    const Vector3d antenna(coordinate(random), coordinate(random), 2),
        s = direction(azimuth(random), elevation(random));
    auto expected = all.trace(antenna, s);
    EXPECT_TRUE(std::is_sorted(expected.begin(), expected.end(),
                               [](const auto& a, const auto& b) { return a.loss_db < b.loss_db; }));
    const std::size_t before = expected.size();
    expected.erase(std::remove_if(expected.begin(), expected.end(),
                                  [&](const DiffractedPath& p) {
                                    return p.loss_db > 30 || p.bending_rad > radians(40) ||
                                           (p.point - antenna).norm() > 40;
                                  }),
                   expected.end());
    if (expected.size() > 2) expected.resize(2);
    dropped += before - expected.size();
    const auto paths = some.trace(antenna, s);
    ASSERT_EQ(paths.size(), expected.size());
    for (std::size_t k = 0; k < paths.size(); ++k) EXPECT_EQ(paths[k].excess_m, expected[k].excess_m);
    kept += paths.size();
  }
  EXPECT_GT(kept, 30u);
  EXPECT_GT(dropped, 30u);
}

TEST(EdgeDiffraction, ThreadsFindTheSame) {
  const World world(quarter(0), {});
  std::vector<Vector3d> sky;
  for (double azimuth = 0; azimuth < 360; azimuth += 5) sky.push_back(direction(azimuth, 10 + azimuth / 10));
  const auto epoch = [&](double x) {
    const Vector3d antenna(x, -x / 2, 2);
    const auto blocked = std::make_unique<bool[]>(sky.size());
    for (std::size_t i = 0; i < sky.size(); ++i) blocked[i] = world.blocked(antenna, sky[i]);
    std::vector<std::vector<DiffractedPath>> paths(sky.size());
    world.diffraction.trace(antenna, sky, {blocked.get(), sky.size()}, paths);
    double sum = 0;
    for (const auto& list : paths) {
      for (const auto& path : list) sum += path.excess_m;
    }
    return sum;
  };
  std::vector<double> expected, sums(16);
  for (int i = 0; i < 16; ++i) expected.push_back(epoch(0.4 * i - 3));
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = t; i < 16; i += 4) sums[static_cast<std::size_t>(i)] = epoch(0.4 * i - 3);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(sums, expected);
  EXPECT_GT(*std::max_element(sums.begin(), sums.end()), 0);
}

TEST(EdgeDiffraction, TheLongestExcessLosesTheMost) {
  for (const double loss : {7.0, 20.0, 35.0, 100.0}) {
    DiffractionOptions options;
    options.max_loss_db = loss;
    EXPECT_NEAR(
        approximate_knife_edge_loss_db(signed_knife_edge_nu(options.max_excess_m(), kWavelength, true)), loss,
        1e-9);
  }
  // By hand: 20 log10(2 nu) + 6.9 = 35 gives nu = 12.7 + 0.1, and 0.1903 m / 4 nu^2 = 7.8 m.
  EXPECT_NEAR(DiffractionOptions{}.max_excess_m(), 7.8, 0.1);
}

TEST(EdgeDiffraction, NamesWhatIsWrong) {
  const canyon::test::SpoiledOptions<DiffractionOptions> message;
  using testing::HasSubstr;
  EXPECT_EQ(message([](DiffractionOptions&) {}), "");
  for (const double bad : {0.0, -1.0, std::nan(""), 1e12}) {
    EXPECT_THAT(message([bad](auto& o) { o.max_range_m = bad; }), HasSubstr("diffraction.max_range_m"));
  }
  DiffractionOptions bad;
  bad.max_range_m = 0;
  const RayScene scene{Mesh{}};
  EXPECT_THROW(EdgeDiffraction(Mesh{}, scene, bad), InputError);
  const EdgeDiffraction open(Mesh{}, scene);
  const Vector3d s = Vector3d::UnitZ();
  const bool blocked = false;
  std::vector<DiffractedPath> paths(1);
  open.trace({0, 0, 0}, {&s, 1}, {&blocked, 1}, {&paths, 1});
  EXPECT_TRUE(paths.empty());
}

}  // namespace
}  // namespace canyon::propagation
