// Two reflections in closed-form scenes: a street canyon, a corner, the ground, a bus; and properties of
// every scene.

#include "canyon/paths/propagation/second_order.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <thread>
#include <tuple>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "tests/support/append_box.hpp"

namespace canyon::propagation::second_order_test {
namespace {

using city::Material;
using city::Mesh;
using city::Surface;
using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using geodesy::radians;
using raytrace::RayScene;

/// Towards a satellite, azimuth from north clockwise.
Vector3d direction(double azimuth_deg, double elevation_deg) {
  return geodesy::enu_from_azimuth_elevation(radians(azimuth_deg), radians(elevation_deg));
}

void append(Mesh& mesh, const Vector3d& min, const Vector3d& max, double yaw_rad = 0) {
  canyon::test::append_box(mesh, "box", Surface::Building, Material::Glass, min, max, yaw_rad);
}

PropagationOptions second_order() {
  PropagationOptions options;
  options.reflection_order = 2;
  return options;
}

struct World {
  Mesh mesh;
  RayScene scene;
  Propagator propagator;

  explicit World(const Mesh& m, const PropagationOptions& options = second_order())
      : mesh(m), scene(mesh), propagator(mesh, scene, options) {}
  SatellitePaths trace(const Vector3d& antenna, const Vector3d& satellite) const {
    SatellitePaths result;
    propagator.trace(antenna, {&satellite, 1}, {&result, 1});
    return result;
  }
};

std::vector<Path> doubles(const SatellitePaths& satellite) {
  std::vector<Path> paths;
  std::copy_if(satellite.paths.begin(), satellite.paths.end(), std::back_inserter(paths),
               [](const Path& path) { return path.order == 2; });
  return paths;
}

/// The length of |antenna, point, far point, satellite| beyond the straight line; satellite at infinity.
double detour(const Vector3d& antenna, const Path& path, const Vector3d& s) {
  return (path.point - antenna).norm() + (path.far_point - path.point).norm() -
         s.dot(path.far_point - antenna);
}

// ---- a street

// Walls 9 m south (30 m high) and 15 m north (300 m high) of the antenna at the height of 2 m; the satellite
// in the south. Signals pass over the low wall, go from the high wall to the low one and then to the antenna.
// Two parallel mirrors move the image by twice their distance: excess = 2 (9 + 15) cos(elevation) cos(azimuth
// from south), for any position of the antenna in the street.
Mesh street() {
  Mesh mesh;
  append(mesh, {-3'000, -20, 0}, {3'000, -9, 30});
  append(mesh, {-3'000, 15, 0}, {3'000, 30, 300});
  return mesh;
}

// Away from the origin, to distinguish values relative to the origin from those relative to the antenna.
const Vector3d kAway(7, -4, 1);

Mesh moved_away(Mesh mesh) {
  for (Vector3d& vertex : mesh.vertices) vertex += kAway;
  return mesh;
}

TEST(SecondOrderStreet, HasTheClosedForm) {
  const World world(moved_away(street()));
  const Vector3d antenna = kAway + Vector3d(0, 0, 2);
  int only_double = 0;
  for (const double off_deg : {-50.0, -20.0, 0.0, 7.0, 35.0}) {
    const double off = std::cos(radians(off_deg));
    for (double elevation_deg = 3; elevation_deg < 85; elevation_deg += 0.5) {
      const double slope = std::tan(radians(elevation_deg)) / off;  // rise over metres across the street
      // After 9 m the ray meets the low wall, after 9 + 24 m the high one, after 24 m more it passes over the
      // low one's edge. No check within a decimetre of an edge.
      const double low = 2 + 9 * slope, high = 2 + 33 * slope, over = 2 + 57 * slope;
      if (std::abs(low - 30) < 0.1 || std::abs(high - 300) < 0.1 || std::abs(over - 30) < 0.1) continue;
      const bool reach = std::hypot(33 / off, 33 * slope) < 300;
      const Vector3d s = direction(180 + off_deg, elevation_deg);
      const SatellitePaths satellite = world.trace(antenna, s);
      const std::vector<Path> paths = doubles(satellite);
      ASSERT_EQ(paths.size(), reach && low < 30 && high < 300 && over > 30 ? 1u : 0u)
          << off_deg << " " << elevation_deg;
      if (paths.empty()) continue;
      const Path& path = paths[0];
      const double excess = 2 * 24 * std::cos(radians(elevation_deg)) * off;
      EXPECT_NEAR(path.excess_m, excess, 1e-9);
      EXPECT_NEAR(detour(antenna, path, s), excess, 1e-9);
      const double along = -std::tan(radians(off_deg));
      EXPECT_LT((path.point - kAway - Vector3d(9 * along, -9, low)).norm(), 1e-9);
      EXPECT_LT((path.far_point - kAway - Vector3d(33 * along, 15, high)).norm(), 1e-9);
      EXPECT_LT((path.arrival - s).norm(), 1e-12) << "two parallel mirrors keep directions";
      EXPECT_NEAR(path.incidence_rad(), std::acos(std::cos(radians(elevation_deg)) * off), 1e-7);
      EXPECT_NEAR(path.far_incidence_rad(), path.incidence_rad(), 1e-9);
      EXPECT_EQ(path.kind, PathKind::Reflected);
      EXPECT_LT(path.triangle, 12u);
      EXPECT_GE(path.far_triangle, 12u);
      EXPECT_LT((antenna_image(path, antenna, s) - kAway - Vector3d(0, 48, 2)).norm(), 1e-9);
      if (satellite.paths.size() == 1) {
        ++only_double;
        EXPECT_EQ(satellite.visibility, Visibility::NLOS);
        EXPECT_NEAR(satellite.tracked_excess_m(), excess, 1e-9);
      }
    }
  }
  EXPECT_GT(only_double, 20) << "elevations at which only two reflections bring the signal in";
}

TEST(SecondOrderStreet, LimitsHoldForBothReflections) {
  const Vector3d antenna(0, 0, 2), s = direction(180 + 50, 45);
  // Path to the second reflection: 33 m across, incidence acos(cos 45 cos 50) = 62.97 deg: 33 / 0.4545 = 72.6
  // m.
  PropagationOptions options = second_order();
  ASSERT_EQ(doubles(World(street(), options).trace(antenna, s)).size(), 1u);
  options.max_range_m = 72.5;
  EXPECT_EQ(doubles(World(street(), options).trace(antenna, s)).size(), 0u);
  options.max_range_m = 72.7;
  EXPECT_EQ(doubles(World(street(), options).trace(antenna, s)).size(), 1u);
  options.max_incidence_rad = radians(62.9);
  EXPECT_EQ(doubles(World(street(), options).trace(antenna, s)).size(), 0u);
  options.max_incidence_rad = radians(63.0);
  EXPECT_EQ(doubles(World(street(), options).trace(antenna, s)).size(), 1u);
  options.reflection_order = 1;
  EXPECT_EQ(doubles(World(street(), options).trace(antenna, s)).size(), 0u);
}

TEST(SecondOrderStreet, EveryLegMustBeClear) {
  const Vector3d antenna(0, 0, 2), s = direction(180, 45);
  // Points: (0, -9, 11), (0, 15, 35). Foliage in the path does not reflect.
  const auto with = [](const Vector3d& middle) {
    Mesh mesh = street();
    canyon::test::append_box(mesh, "tree", Surface::Foliage, Material::Wood, middle - Vector3d::Constant(0.5),
                             middle + Vector3d::Constant(0.5));
    return mesh;
  };
  ASSERT_EQ(doubles(World(street()).trace(antenna, s)).size(), 1u);
  EXPECT_EQ(doubles(World(with({0, -5, 7})).trace(antenna, s)).size(), 0u) << "antenna to the near point";
  EXPECT_EQ(doubles(World(with({0, 5, 25})).trace(antenna, s)).size(), 0u) << "between the points";
  EXPECT_EQ(doubles(World(with({0, -3, 53})).trace(antenna, s)).size(), 0u) << "far point to the satellite";
  EXPECT_EQ(doubles(World(with({0, -5, 12})).trace(antenna, s)).size(), 1u) << "beside all of them";
}

TEST(SecondOrderStreet, FacetsOfOneWallGiveOnePath) {
  // The high wall twice, in two parts and in overlapping parts; the low one as well.
  for (const int variant : {0, 1, 2}) {
    Mesh mesh = street();
    if (variant == 0) {
      append(mesh, {-3'000, 15, 0}, {3'000, 30, 300});
      append(mesh, {-3'000, -20, 0}, {3'000, -9, 30});
    } else {
      mesh = Mesh();
      const double overlap = variant == 1 ? 0 : 5;
      append(mesh, {-3'000, -20, 0}, {overlap, -9, 30});
      append(mesh, {-overlap, -25, 0}, {3'000, -9, 30});
      append(mesh, {-3'000, 15, 0}, {overlap, 30, 300});
      append(mesh, {-overlap, 15, 0}, {3'000, 35, 290});
    }
    const World world(mesh);
    for (const double off : {-30.0, -5.0, 0.0, 1e-9, 5.0, 30.0}) {
      const Vector3d s = direction(180 + off, 45);
      const std::vector<Path> paths = doubles(world.trace({0, 0, 2}, s));
      ASSERT_EQ(paths.size(), 1u) << variant << " " << off;
      EXPECT_NEAR(paths[0].excess_m, 48 * std::cos(radians(45)) * std::cos(radians(off)), 1e-9);
    }
  }
}

// A wall drawn by two buildings 0.4 mm apart and rotated by 0.02 deg relative to each other: still one path.
TEST(SecondOrderStreet, WallsDrawnNotQuiteAlikeGiveOnePath) {
  Mesh mesh;
  append(mesh, {-50, -20, 0}, {50, -9, 30});
  append(mesh, {-50, 15, 0}, {50, 30, 300});
  append(mesh, {-50, 15.0002, 0}, {50, 30, 300}, 1e-6);
  append(mesh, {-50, -20, 0}, {50, -9.0002, 30}, -1e-6);
  const World world(mesh);
  for (const double off : {-20.0, 0.0, 3.0, 30.0}) {
    EXPECT_EQ(doubles(world.trace({0, 0, 2}, direction(180 + off, 45))).size(), 1u) << off;
  }
}

// ---- corners

// Walls 12 m east and 20 m north of the antenna. Two mirrors at a right angle rotate the image about their
// edge, in either order: it is at (24, 40), the excess is -2 (12 s_x + 20 s_y), and the signal comes from the
// satellite's azimuth + 180 deg at the same elevation, for every azimuth.
TEST(SecondOrderCorner, ReturnsEverySatelliteToItsOwnAzimuth) {
  Mesh mesh;
  append(mesh, {-600, 20, 0}, {12, 40, 400});
  append(mesh, {12, -600, 0}, {30, 40, 400});
  const World world(moved_away(mesh));
  const Vector3d antenna = kAway + Vector3d(0, 0, 2);
  int east_next = 0, north_next = 0;
  for (double azimuth = 181; azimuth < 270; azimuth += 0.5) {
    for (const double elevation : {5.0, 35.0, 60.0}) {
      const Vector3d s = direction(azimuth, elevation);
      // The line from the image at (24, 40) passes the edge (12, 20): there the point is in both walls. At
      // grazing incidence on either wall (89 deg) there is no path.
      const double across = 20 * s.x() - 12 * s.y();
      if (std::abs(across) < 0.01 || std::min(-s.x(), -s.y()) < std::cos(radians(89))) continue;
      const double far_path = std::max(24 - 12, 40 - 20) / std::min(-s.x(), -s.y());
      const SatellitePaths satellite = world.trace(antenna, s);
      const std::vector<Path> paths = doubles(satellite);
      const Path* path = paths.empty() ? nullptr : &paths[0];
      if (path == nullptr) {
        EXPECT_GT(far_path, 250) << azimuth << " " << elevation << ": only out of reach there is none";
        continue;
      }
      ASSERT_EQ(paths.size(), 1u);
      EXPECT_NEAR(path->excess_m, -2 * (12 * s.x() + 20 * s.y()), 1e-9);
      EXPECT_LT((path->arrival - Vector3d(-s.x(), -s.y(), s.z())).norm(), 1e-12);
      EXPECT_LT((antenna_image(*path, antenna, s) - kAway - Vector3d(24, 40, 2)).norm(), 1e-9);
      const bool east = std::abs(path->point.x() - kAway.x() - 12) < 1e-9;
      // From the antenna towards (-s): the east wall comes first where 12 / |s_x| < 20 / |s_y|.
      EXPECT_EQ(east, 12 * -s.y() < 20 * -s.x());
      (east ? east_next : north_next) += 1;
      ASSERT_EQ(satellite.paths.size(), 4u) << "direct, two single reflections, one double";
      EXPECT_TRUE(std::is_sorted(satellite.paths.begin(), satellite.paths.end(),
                                 [](const Path& a, const Path& b) { return a.excess_m < b.excess_m; }));
    }
  }
  EXPECT_GT(east_next, 50);
  EXPECT_GT(north_next, 50);
}

// Ground and a wall: 3 m over the ground, 20 m from the wall, excess 2 * 20 cos(el) cos(off) + 2 * 3 sin(el).
TEST(SecondOrderCorner, ReflectsByGroundAndWall) {
  Mesh mesh;
  city::append_object(mesh, "ground", Surface::Terrain, Material::Concrete,
                      {{-500, -500, 0}, {500, -500, 0}, {500, 500, 0}, {-500, 500, 0}},
                      {{0, 1, 2}, {0, 2, 3}});
  append(mesh, {-500, 20, -1}, {500, 30, 400});
  PropagationOptions options = second_order();
  const Vector3d antenna = kAway + Vector3d(0, 0, 3);
  EXPECT_EQ(doubles(World(moved_away(mesh), options).trace(antenna, direction(190, 30))).size(), 0u);
  options.ground_reflection = true;
  const World world(moved_away(mesh), options);
  bool ground_next = false, wall_next = false;
  for (const double off : {-40.0, 0.0, 10.0}) {
    for (const double elevation : {4.0, 8.0, 30.0, 60.0}) {
      const Vector3d s = direction(180 + off, elevation);
      const std::vector<Path> paths = doubles(world.trace(antenna, s));
      ASSERT_EQ(paths.size(), 1u) << off << " " << elevation;
      EXPECT_NEAR(paths[0].excess_m, 40 * -s.y() + 6 * s.z(), 1e-9);
      EXPECT_LT((paths[0].arrival - Vector3d(s.x(), -s.y(), -s.z())).norm(), 1e-12);
      (std::abs(paths[0].point.z() - kAway.z()) < 1e-9 ? ground_next : wall_next) = true;
    }
  }
  EXPECT_TRUE(ground_next && wall_next) << "both orders occur";
}

// ---- movable instances

using Key = std::tuple<double, Vector3d, Vector3d>;

std::vector<Key> keys(const SatellitePaths& satellite) {
  std::vector<Key> all;
  for (const Path& path : doubles(satellite)) all.emplace_back(path.excess_m, path.point, path.far_point);
  return all;
}

/// Buses in a street as instances compared with the same buses in the static mesh: the same paths, by bus and
/// wall, by wall and bus, by bus and bus.
TEST(SecondOrderInstances, GiveThePathsOfTheSameThingsStandingStill) {
  Mesh bus;
  canyon::test::append_box(bus, "bus", Surface::Building, Material::Metal, {-6, -1.25, 0}, {6, 1.25, 4});
  Mesh walls;
  append(walls, {-100, -20, 0}, {100, -9, 3.5});
  append(walls, {-100, 15, 0}, {100, 30, 60});
  const std::array<Isometry3d, 3> poses = {
      Eigen::Translation3d(3, 8, 0) * AngleAxisd(0.1, Vector3d::UnitZ()),
      Eigen::Translation3d(-2, -5, 0) * AngleAxisd(-0.15, Vector3d::UnitZ()),
      Eigen::Translation3d(14, 2, 0.3) * AngleAxisd(1.2, Vector3d(0.05, 0, 1).normalized())};
  World moving(walls);
  Mesh still = walls;
  for (const Isometry3d& pose : poses) {
    moving.scene.set_pose(moving.scene.add_instance(bus), pose);
    const auto first = static_cast<std::uint32_t>(still.vertices.size());
    canyon::test::append_box(still, "bus", Surface::Building, Material::Metal, {-6, -1.25, 0}, {6, 1.25, 4});
    for (std::size_t v = first; v < still.vertices.size(); ++v) still.vertices[v] = pose * still.vertices[v];
  }
  moving.scene.commit();
  const World is_stationary(still);
  std::mt19937_64 random(41);
  std::uniform_real_distribution<double> azimuth(0, 360), elevation(1, 30), x(-6, 8), y(-3, 6), up(0.5, 3.5);
  std::array<int, 4> kinds{};  // city-city, bus next to the antenna, bus next to the satellite, both
  for (int i = 0; i < 20'000; ++i) {
    const Vector3d antenna(x(random), y(random), up(random)),
        s = direction(azimuth(random), elevation(random));
    const SatellitePaths a = moving.trace(antenna, s), b = is_stationary.trace(antenna, s);
    const std::vector<Key> ka = keys(a), kb = keys(b);
    ASSERT_EQ(ka.size(), kb.size()) << antenna.transpose() << " towards " << s.transpose();
    for (const auto& [excess, point, far_point] : ka) {
      EXPECT_TRUE(std::any_of(kb.begin(), kb.end(),
                              [&, e = excess, p = point, f = far_point](const Key& k) {
                                return std::abs(std::get<0>(k) - e) < 1e-9 &&
                                       (std::get<1>(k) - p).norm() < 1e-6 &&
                                       (std::get<2>(k) - f).norm() < 1e-6;
                              }))
          << antenna.transpose() << " towards " << s.transpose();
    }
    for (const Path& path : doubles(a)) {
      kinds[(path.instance != 0 ? 1u : 0u) + (path.far_instance != 0 ? 2u : 0u)] += 1;
      EXPECT_NEAR(path.excess_m, detour(antenna, path, s), 1e-9);
      EXPECT_LT(
          std::max(path.instance != 0 ? path.triangle : 0, path.far_instance != 0 ? path.far_triangle : 0),
          12u);
    }
  }
  EXPECT_THAT(kinds, testing::Each(testing::Gt(20)));
}

// ---- properties of every scene

Mesh random_city(unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> at(-70, 70), size(8, 30), height(5, 60), yaw(0, geodesy::kPi);
  Mesh mesh;
  for (int i = 0; i < 22; ++i) {
    const Vector3d corner(at(random), at(random), 0);
    append(mesh, corner, corner + Vector3d(size(random), size(random), height(random)), yaw(random));
  }
  return mesh;
}

struct Sample {
  std::vector<Vector3d> positions, sky;
};
Sample sample(const RayScene& scene, std::size_t count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> x(-80, 80), azimuth(0, 360), elevation(3, 85);
  Sample s;
  while (s.positions.size() < count) {
    const Vector3d point(x(random), x(random), 2);
    if (scene.containment(point) == raytrace::Containment::Free) s.positions.push_back(point);
  }
  for (int i = 0; i < 70; ++i) s.sky.push_back(direction(azimuth(random), elevation(random)));
  return s;
}

// Both ends may be exchanged: a ray from the satellite through the far point is reflected where it hits the
// city (by the normals of the ray caster) and reaches the antenna; a source at the distance S sees the double
// image, and |S - image| - |S - antenna| is the excess, to |image - antenna|^2 / |S|: 0.4 mm at 1,000,000 km
// for images up to 600 m away.
TEST(SecondOrder, IsReciprocal) {
  int seen = 0;
  for (unsigned seed = 50; seed < 60; ++seed) {
    const World world(random_city(seed));
    const Sample many = sample(world.scene, 40, seed);
    for (const Vector3d& antenna : many.positions) {
      for (const Vector3d& s : many.sky) {
        for (const Path& path : doubles(world.trace(antenna, s))) {
          ++seen;
          Vector3d from = path.far_point + 300 * s, along = -s;
          for (const Vector3d& point : {path.far_point, path.point}) {
            const auto hit = world.scene.cast({from, along}, 1e-2);
            ASSERT_TRUE(hit && hit->front);
            EXPECT_NEAR((from + hit->range_m * along - point).norm(), 0, 1e-3);
            from += hit->range_m * along;
            along -= 2 * along.dot(hit->normal) * hit->normal;
          }
          EXPECT_LT((from + (antenna - from).norm() * along - antenna).norm(), 1e-3);
          EXPECT_FALSE(world.scene.occluded({from, along, (antenna - from).norm() - 1e-2}, 1e-2));
          const Vector3d image = antenna_image(path, antenna, s), source = antenna + 1e9 * s;
          EXPECT_NEAR((source - image).norm() - (source - antenna).norm(), path.excess_m, 1e-3);
          EXPECT_NEAR(s.dot(antenna - image), path.excess_m, 1e-9);
          EXPECT_NEAR(detour(antenna, path, s), path.excess_m, 1e-9);
          EXPECT_LT((path.arrival - (path.point - antenna).normalized()).norm(), 1e-9);
        }
      }
    }
  }
  EXPECT_GT(seen, 500);
}

// The rates by the image: d(excess)/dt by differences of traced paths, antenna and satellite moving.
TEST(SecondOrder, TheImageGivesTheRateOfTheExcess) {
  const World world(street());
  const Vector3d antenna(0, 0, 2), velocity(3, -2, 0.5);
  const Vector3d s = direction(200, 45), rotation_rate = 1e-4 * s.cross(Vector3d(0.3, 0.5, 0.8)).eval();
  const auto excess = [&](double t) {
    const std::vector<Path> paths =
        doubles(world.trace(antenna + t * velocity, (s + t * rotation_rate).normalized()));
    return paths.at(0).excess_m;
  };
  const Path path = doubles(world.trace(antenna, s)).at(0);
  const double rate =
      rotation_rate.dot(antenna - antenna_image(path, antenna, s)) + (s - path.arrival).dot(velocity);
  EXPECT_NEAR((excess(0.01) - excess(-0.01)) / 0.02, rate, 1e-7);
  EXPECT_GT(std::abs(rate), 1e-4);
}

TEST(SecondOrder, LeavesTheLowerOrdersAsTheyAre) {
  const Mesh mesh = random_city(61);
  const World first(mesh, PropagationOptions{}), second(mesh);
  const Sample many = sample(first.scene, 100, 61);
  int paths = 0, more = 0;
  for (const Vector3d& antenna : many.positions) {
    std::vector<SatellitePaths> a(many.sky.size()), b(many.sky.size());
    first.propagator.trace(antenna, many.sky, a);
    second.propagator.trace(antenna, many.sky, b);
    for (std::size_t i = 0; i < a.size(); ++i) {
      std::size_t k = 0;
      for (const Path& path : b[i].paths) {
        EXPECT_EQ(path.kind == PathKind::Direct, path.order == 0);
        if (path.order == 2) {
          ++more;
          continue;
        }
        ++paths;
        ASSERT_LT(k, a[i].paths.size());
        const Path& same = a[i].paths[k++];
        EXPECT_EQ(path.excess_m, same.excess_m);
        EXPECT_EQ(path.point, same.point);
        EXPECT_EQ(path.arrival, same.arrival);
        EXPECT_EQ(path.incidence_rad(), same.incidence_rad());
        EXPECT_EQ(path.triangle, same.triangle);
        EXPECT_EQ(path.order, same.order);
      }
      EXPECT_EQ(k, a[i].paths.size());
      EXPECT_TRUE(std::is_sorted(b[i].paths.begin(), b[i].paths.end(),
                                 [](const Path& x, const Path& y) { return x.excess_m < y.excess_m; }));
    }
  }
  EXPECT_GT(paths, 1'000);
  EXPECT_GT(more, 50);
}

TEST(SecondOrder, TurnsAndMovesWithTheWorld) {
  const Mesh mesh = random_city(62);
  Isometry3d pose = Isometry3d::Identity();
  pose.translate(Vector3d(310, -470, 25));
  pose.rotate(AngleAxisd(0.7, Vector3d(0.2, -0.4, 0.9).normalized()));
  Mesh rotated = mesh;
  for (Vector3d& vertex : rotated.vertices) vertex = pose * vertex;
  const World here(mesh), there(rotated);
  const Sample many = sample(here.scene, 60, 62);
  int paths = 0;
  for (const Vector3d& antenna : many.positions) {
    for (const Vector3d& s : many.sky) {
      const auto a = doubles(here.trace(antenna, s)),
                 b = doubles(there.trace(pose * antenna, pose.linear() * s));
      ASSERT_EQ(a.size(), b.size()) << antenna.transpose() << " towards " << s.transpose();
      for (std::size_t k = 0; k < a.size(); ++k) {
        ++paths;
        EXPECT_NEAR(a[k].excess_m, b[k].excess_m, 1e-9);
        EXPECT_LT((pose * a[k].point - b[k].point).norm(), 1e-6);
        EXPECT_LT((pose * a[k].far_point - b[k].far_point).norm(), 1e-6);
        EXPECT_EQ(a[k].triangle, b[k].triangle);
        EXPECT_EQ(a[k].far_triangle, b[k].far_triangle);
      }
    }
  }
  EXPECT_GT(paths, 50);
}

TEST(SecondOrder, AnswersAlikeForOneAndForManyAndOnThreads) {
  World world(random_city(63));
  Mesh bus;
  canyon::test::append_box(bus, "bus", Surface::Vehicle, Material::Metal, {-6, -1, 0}, {6, 1, 4});
  for (const double x : {-40.0, 10.0, 30.0}) {
    world.scene.set_pose(world.scene.add_instance(bus), Isometry3d(Eigen::Translation3d(x, 4, 0)));
  }
  world.scene.commit();
  const Sample many = sample(world.scene, 60, 63);
  std::vector<std::vector<SatellitePaths>> alone(many.positions.size());
  int paths = 0;
  for (std::size_t p = 0; p < alone.size(); ++p) {
    for (const Vector3d& s : many.sky) alone[p].push_back(world.trace(many.positions[p], s));
    for (const SatellitePaths& satellite : alone[p]) paths += static_cast<int>(doubles(satellite).size());
  }
  EXPECT_GT(paths, 50);
  std::array<int, 3> wrong{};
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < wrong.size(); ++t) {
    threads.emplace_back([&, t] {
      std::vector<SatellitePaths> result(many.sky.size());
      for (std::size_t p = 0; p < alone.size(); ++p) {
        world.propagator.trace(many.positions[p], many.sky, result);
        for (std::size_t i = 0; i < result.size(); ++i) {
          const SatellitePaths &a = alone[p][i], &b = result[i];
          bool same = a.visibility == b.visibility && a.paths.size() == b.paths.size();
          for (std::size_t k = 0; same && k < a.paths.size(); ++k) {
            same = a.paths[k].excess_m == b.paths[k].excess_m && a.paths[k].point == b.paths[k].point &&
                   a.paths[k].far_point == b.paths[k].far_point && a.paths[k].order == b.paths[k].order &&
                   a.paths[k].triangle == b.paths[k].triangle &&
                   a.paths[k].far_triangle == b.paths[k].far_triangle;
          }
          wrong[t] += same ? 0 : 1;
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_THAT(wrong, testing::Each(0));
}

}  // namespace
}  // namespace canyon::propagation::second_order_test
