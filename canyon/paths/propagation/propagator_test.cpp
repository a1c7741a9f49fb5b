// Closed-form scenes: a wall, a corner, a street canyon, and the special cases of each.

#include "canyon/paths/propagation/propagator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <thread>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/spoiled_options.hpp"

namespace canyon::propagation::propagator_test {
namespace {

using city::Material;
using city::Mesh;
using city::Surface;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using raytrace::RayScene;

constexpr double kMillimetre = 1e-3;

/// Towards a satellite, azimuth from north clockwise.
Vector3d direction(double azimuth_deg, double elevation_deg) {
  return geodesy::enu_from_azimuth_elevation(geodesy::radians(azimuth_deg), geodesy::radians(elevation_deg));
}

void append(Mesh& mesh, const Vector3d& min, const Vector3d& max, double yaw_rad = 0) {
  canyon::test::append_box(mesh, "box", Surface::Building, Material::Glass, min, max, yaw_rad);
}

/// A rectangle from `corner` along `u` and `v`; its front is to the side of u x v.
void append_sheet(Mesh& mesh, const Vector3d& corner, const Vector3d& u, const Vector3d& v,
                  Surface surface = Surface::Building) {
  city::append_object(mesh, "sheet", surface, Material::Glass,
                      {corner, corner + u, corner + u + v, corner + v}, {{0, 1, 2}, {0, 2, 3}});
}

/// A scene and its propagator.
struct World {
  Mesh mesh;
  RayScene scene;
  Propagator propagator;

  explicit World(const Mesh& m, const PropagationOptions& options = {})
      : mesh(m), scene(mesh), propagator(mesh, scene, options) {}
  SatellitePaths trace(const Vector3d& antenna, const Vector3d& satellite) const {
    SatellitePaths result;
    propagator.trace(antenna, {&satellite, 1}, {&result, 1});
    return result;
  }
};

PropagationOptions mirror(double max_range_m = 300) {
  PropagationOptions options;
  options.model = Model::Mirror;
  options.max_range_m = max_range_m;
  return options;
}

/// The length of |antenna, point, satellite| beyond the straight line; the satellite is at infinity.
double detour(const Vector3d& antenna, const Vector3d& point, const Vector3d& s) {
  return (point - antenna).norm() - s.dot(point - antenna);
}

// ---- words and options

TEST(Paths, VisibilityHasTheWordsOfTheOutputs) {
  EXPECT_EQ(name(Visibility::LOS), "LOS");
  EXPECT_EQ(name(Visibility::LOSMultipath), "LOS+multipath");
  EXPECT_EQ(name(Visibility::NLOS), "NLOS");
  EXPECT_EQ(name(Visibility::Blocked), "blocked");
}

TEST(Paths, TheTrackedPathIsTheShortest) {
  SatellitePaths satellite;
  EXPECT_EQ(satellite.tracked_excess_m(), 0);
  EXPECT_FALSE(satellite.received());
  Path reflected;
  reflected.kind = PathKind::Reflected;
  reflected.excess_m = 31;
  satellite.paths.push_back(reflected);
  reflected.excess_m = 17;
  satellite.paths.push_back(reflected);
  satellite.visibility = Visibility::NLOS;
  EXPECT_EQ(satellite.tracked_excess_m(), 17);
  EXPECT_TRUE(satellite.received());
  satellite.paths.push_back(Path{});
  EXPECT_EQ(satellite.tracked_excess_m(), 0);
}

TEST(Paths, ArrangedTheySayTheirVisibility) {
  const auto of = [](std::initializer_list<std::pair<PathKind, double>> list) {
    SatellitePaths satellite;
    for (const auto& [kind, excess_m] : list) {
      Path path;
      path.kind = kind;
      path.excess_m = excess_m;
      satellite.paths.push_back(path);
    }
    satellite.arrange();
    return satellite;
  };
  EXPECT_EQ(of({}).visibility, Visibility::Blocked);
  EXPECT_EQ(of({{PathKind::Diffuse, 9}}).visibility, Visibility::NLOS);
  EXPECT_EQ(of({{PathKind::Direct, 0}, {PathKind::Diffracted, 0.1}}).visibility, Visibility::LOS)
      << "an edge beside the path does not count";
  // A direct path stays the first one, even with a large delay.
  const SatellitePaths mixed =
      of({{PathKind::Reflected, 30}, {PathKind::Diffracted, 5}, {PathKind::Direct, 8}});
  EXPECT_EQ(mixed.visibility, Visibility::LOSMultipath);
  EXPECT_EQ(mixed.paths[0].kind, PathKind::Direct);
  EXPECT_EQ(mixed.paths[1].kind, PathKind::Diffracted);
  EXPECT_EQ(mixed.paths[2].kind, PathKind::Reflected);
}

TEST(Paths, TheImageIsWhereTheMirrorsShowTheAntenna) {
  const Vector3d antenna(1, 2, 3), s = direction(190, 30);
  EXPECT_EQ(antenna_image(Path{}, antenna, s), antenna);
  Mesh mesh;
  append(mesh, {-100, 20, 0}, {100, 30, 100});
  const SatellitePaths paths = World(mesh).trace(antenna, s);
  ASSERT_EQ(paths.paths.size(), 2u);
  EXPECT_TRUE(antenna_image(paths.paths[1], antenna, s).isApprox(Vector3d(1, 38, 3), 1e-12));
}

TEST(PropagationOptions, NameTheFieldThatIsWrong) {
  const canyon::test::SpoiledOptions<PropagationOptions> message;
  using testing::HasSubstr;
  EXPECT_EQ(message([](PropagationOptions&) {}), "");
  EXPECT_THAT(message([](PropagationOptions& o) { o.reflection_order = 3; }),
              HasSubstr("reflection_order is 3"));
  EXPECT_THAT(message([](PropagationOptions& o) { o.reflection_order = -1; }),
              HasSubstr("it must be from 0 to 2"));
  for (const double bad : {0.0, -1.0, 100'001.0, std::nan("")}) {
    EXPECT_THAT(message([bad](PropagationOptions& o) { o.max_range_m = bad; }), HasSubstr("max_range_m"));
  }
  for (const double bad : {0.0, 1.6, 89.0, std::nan("")}) {
    EXPECT_THAT(message([bad](PropagationOptions& o) { o.max_incidence_rad = bad; }),
                HasSubstr("max_incidence_rad"));
  }
  PropagationOptions bad;
  bad.max_range_m = -5;
  const Mesh empty;
  const RayScene scene(empty);
  EXPECT_THROW(Propagator(empty, scene, bad), InputError);
}

TEST(Propagator, RefusesAnAntennaThatIsNowhere) {
  const World world{Mesh{}};
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW((void)world.trace({0, bad, 0}, direction(0, 45)), InputError);
  }
}

TEST(Propagator, TheOpenSkyIsAllLineOfSight) {
  for (const PropagationOptions& options : {PropagationOptions{}, mirror()}) {
    const World world(Mesh{}, options);
    const SatellitePaths paths = world.trace({3, 4, 5}, direction(77, 12));
    EXPECT_EQ(paths.visibility, Visibility::LOS);
    ASSERT_EQ(paths.paths.size(), 1u);
    EXPECT_EQ(paths.paths[0].kind, PathKind::Direct);
    EXPECT_EQ(paths.paths[0].excess_m, 0);
    EXPECT_TRUE(paths.paths[0].arrival.isApprox(direction(77, 12)));
  }
}

// ---- one wall

// A wall 20 m north of the antenna, which is away from the origin on every axis. Closed form: excess path 2 h
// cos(elevation) cos(azimuth from the wall's normal), reflection point h tan(azimuth difference) along the
// wall and h tan(elevation) / cos(azimuth difference) above the antenna, arrival from the mirrored azimuth.
TEST(OneWall, ReflectsByTheClosedForm) {
  const Vector3d antenna(-7, 11, 2);
  Mesh mesh;
  append(mesh, {-2'000, 31, 0}, {2'000, 41, 3'000});
  PropagationOptions options;
  options.max_range_m = 2'000;
  const World world(mesh, options);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> off_normal_deg(-80, 80), elevation_deg(1, 80);
  for (int i = 0; i < 2'000; ++i) {
    const double off = off_normal_deg(random), elevation = elevation_deg(random);
    const Vector3d s = direction(180 + off, elevation);
    const SatellitePaths paths = world.trace(antenna, s);
    ASSERT_EQ(paths.visibility, Visibility::LOSMultipath) << off << " " << elevation;
    ASSERT_EQ(paths.paths.size(), 2u);
    EXPECT_EQ(paths.paths[0].kind, PathKind::Direct);
    const Path& path = paths.paths[1];
    EXPECT_EQ(path.kind, PathKind::Reflected);
    const double cosine = std::cos(geodesy::radians(elevation)) * std::cos(geodesy::radians(off));
    EXPECT_NEAR(path.excess_m, 2 * 20 * cosine, 1e-9);
    EXPECT_NEAR(path.incidence_rad(), std::acos(cosine), 1e-9);
    const double tangent = std::tan(geodesy::radians(elevation));
    EXPECT_NEAR(path.point.x(), antenna.x() - 20 * std::tan(geodesy::radians(off)), 1e-9);
    EXPECT_NEAR(path.point.y(), 31, 1e-9);
    EXPECT_NEAR(path.point.z(), antenna.z() + 20 * tangent / std::cos(geodesy::radians(off)), 1e-9);
    EXPECT_NEAR((path.arrival - direction(-off, elevation)).norm(), 0, 1e-12);
    EXPECT_EQ(paths.tracked_excess_m(), 0) << "the direct path is tracked";
  }
}

TEST(OneWall, BlocksTheSideBehindItWithoutAReflection) {
  Mesh mesh;
  append(mesh, {-2'000, 20, 0}, {2'000, 30, 3'000});
  const World world(mesh);
  for (const double azimuth : {-80.0, -30.0, 0.0, 45.0, 85.0}) {
    const SatellitePaths paths = world.trace({0, 0, 2}, direction(azimuth, 30));
    EXPECT_EQ(paths.visibility, Visibility::Blocked);
    EXPECT_TRUE(paths.paths.empty());
  }
}

TEST(OneWall, ReflectsOnlyFromItsFront) {
  // One sheet in the plane y = 20; u x v = -y faces the antenna, +y does not.
  for (const bool facing : {true, false}) {
    Mesh mesh;
    const Vector3d along(facing ? 200 : -200, 0, 0);
    append_sheet(mesh, {facing ? -100.0 : 100.0, 20, 0}, along, {0, 0, 100});
    const World world(mesh);
    EXPECT_EQ(world.trace({0, 0, 2}, direction(190, 30)).visibility,
              facing ? Visibility::LOSMultipath : Visibility::LOS);
    EXPECT_EQ(world.trace({0, 0, 2}, direction(10, 30)).visibility, Visibility::Blocked)
        << "both sides block";
  }
}

TEST(OneWall, EndsAtItsEdges) {
  // Wall x in [-5, 8], z in [0, 15], 10 m north. Reflection point: x = -10 tan(off), z = 2 + 10 tan(el) /
  // cos(off).
  Mesh mesh;
  append_sheet(mesh, {-5, 10, 0}, {13, 0, 0}, {0, 0, 15});
  const World world(mesh);
  const auto paths_at = [&](double x, double z) {
    // Satellite whose reflection is in (x, 10, z): the straight line to it, mirrored in y.
    const Vector3d r = (Vector3d(x, 10, z) - Vector3d(0, 0, 2)).normalized();
    return world.trace({0, 0, 2}, {r.x(), -r.y(), r.z()}).paths.size();
  };
  for (const double inside : {1e-3, 0.01, 1.0}) {
    EXPECT_EQ(paths_at(-5 + inside, 7), 2u) << inside;
    EXPECT_EQ(paths_at(8 - inside, 7), 2u) << inside;
    EXPECT_EQ(paths_at(1, 15 - inside), 2u) << inside;
    EXPECT_EQ(paths_at(-5 - inside, 7), 1u) << inside;
    EXPECT_EQ(paths_at(8 + inside, 7), 1u) << inside;
    EXPECT_EQ(paths_at(1, 15 + inside), 1u) << inside;
  }
}

TEST(OneWall, ItsDiagonalGivesOnePath) {
  // Both diagonals of the wall x in [-10, 10], z in [0, 20]; one of them is the edge between its triangles.
  Mesh mesh;
  append(mesh, {-10, 10, 0}, {10, 20, 20});
  const World world(mesh);
  const Vector3d antenna(0, 0, 0.5);
  for (int i = 1; i < 400; ++i) {
    const double along = i / 400.0;
    for (const double x : {-10 + 20 * along, 10 - 20 * along}) {
      const Vector3d point(x, 10, 20 * along);
      if (point.z() <= antenna.z()) continue;
      const Vector3d r = (point - antenna).normalized();
      const SatellitePaths paths = world.trace(antenna, {r.x(), -r.y(), r.z()});
      ASSERT_EQ(paths.paths.size(), 2u) << point.transpose();
      EXPECT_NEAR((paths.paths[1].point - point).norm(), 0, 1e-9);
    }
  }
}

TEST(OneWall, HonoursReachIncidenceAndOrder) {
  Mesh mesh;
  append(mesh, {-2'000, 20, 0}, {2'000, 30, 3'000});
  const Vector3d antenna(0, 0, 2), s = direction(180 + 60, 30);
  // cos(incidence) = cos 30 cos 60 = 0.4330, incidence 64.34 deg; leg 20 / 0.4330 = 46.19 m.
  PropagationOptions options;
  EXPECT_EQ(World(mesh, options).trace(antenna, s).visibility, Visibility::LOSMultipath);
  options.max_range_m = 46.0;
  EXPECT_EQ(World(mesh, options).trace(antenna, s).visibility, Visibility::LOS);
  options.max_range_m = 46.3;
  EXPECT_EQ(World(mesh, options).trace(antenna, s).visibility, Visibility::LOSMultipath);
  options.max_incidence_rad = geodesy::radians(64.3);
  EXPECT_EQ(World(mesh, options).trace(antenna, s).visibility, Visibility::LOS);
  options.max_incidence_rad = geodesy::radians(64.4);
  EXPECT_EQ(World(mesh, options).trace(antenna, s).visibility, Visibility::LOSMultipath);
  options.reflection_order = 0;
  EXPECT_EQ(World(mesh, options).trace(antenna, s).visibility, Visibility::LOS);
  // The range limit applies to reflections, not to blocking: a wall 1 km away hides a satellite.
  Mesh far;
  append(far, {-2'000, 1'000, 0}, {2'000, 1'010, 900});
  options.max_range_m = 50;
  EXPECT_EQ(World(far, options).trace(antenna, direction(0, 30)).visibility, Visibility::Blocked);
  EXPECT_EQ(World(far, mirror(50)).trace(antenna, direction(0, 30)).visibility, Visibility::Blocked);
}

TEST(OneWall, LegsMustBeClear) {
  Mesh mesh;
  append(mesh, {-100, 20, 0}, {100, 30, 100});
  const Vector3d antenna(0, 0, 2), s = direction(180, 30);  // reflection point (0, 20, 13.55)
  ASSERT_EQ(World(mesh).trace(antenna, s).paths.size(), 2u);

  // The obstacle is foliage, which does not reflect.
  const auto with = [&mesh](const Vector3d& min, const Vector3d& max) {
    Mesh hidden = mesh;
    canyon::test::append_box(hidden, "tree", Surface::Foliage, Material::Wood, min, max);
    return hidden;
  };
  // Across the leg to the wall: at y = 10 that is 7.77 m high.
  EXPECT_EQ(World(with({-1, 9, 7}, {1, 11, 9})).trace(antenna, s).visibility, Visibility::LOS);
  // Across the leg to the satellite, above the antenna: at y = 0 it is 25.1 m high.
  EXPECT_EQ(World(with({-1, -1, 24}, {1, 1, 26})).trace(antenna, s).visibility, Visibility::LOS);
  // Across the direct ray only: at y = -10 that is 7.77 m high.
  const SatellitePaths paths = World(with({-1, -11, 7}, {1, -9, 9})).trace(antenna, s);
  EXPECT_EQ(paths.visibility, Visibility::NLOS);
  ASSERT_EQ(paths.paths.size(), 1u);
  EXPECT_NEAR(paths.tracked_excess_m(), 2 * 20 * std::cos(geodesy::radians(30)), 1e-9);
}

TEST(OneWall, DegeneratePlacesGiveNoPathAndNoFault) {
  Mesh mesh;
  append(mesh, {-100, 20, 0}, {100, 30, 100});
  const World world(mesh);
  // The antenna in the wall's plane next to it, and on the wall itself.
  EXPECT_EQ(world.trace({-150, 20, 2}, direction(180, 30)).visibility, Visibility::LOS);
  EXPECT_EQ(world.trace({0, 20, 2}, direction(180, 30)).visibility, Visibility::LOS);
  // The satellite in the wall's plane.
  EXPECT_EQ(world.trace({0, 0, 2}, direction(90, 30)).visibility, Visibility::LOS);
  EXPECT_EQ(world.trace({0, 0, 2}, direction(90 + 1e-9, 30)).visibility, Visibility::LOS);
  EXPECT_EQ(world.trace({0, 0, 2}, {0, 0, 1}).visibility, Visibility::LOS);
  // On the roof: an antenna on a surface sees the sky.
  EXPECT_EQ(world.trace({0, 25, 100}, direction(0, 5)).visibility, Visibility::LOS);
}

TEST(OneWall, SharedAndCoincidentWallsGiveOnePath) {
  Mesh twice;  // the same building twice
  append(twice, {-100, 20, 0}, {100, 30, 100});
  append(twice, {-100, 20, 0}, {100, 30, 100});
  Mesh row;  // two adjacent buildings, one facade
  append(row, {-100, 20, 0}, {0, 30, 100});
  append(row, {0, 20, 0}, {100, 35, 90});
  Mesh overlapping;  // facades in one plane that overlap
  append(overlapping, {-100, 20, 0}, {10, 30, 100});
  append(overlapping, {-10, 20, 0}, {100, 35, 90});
  for (const Mesh& mesh : {twice, row, overlapping}) {
    const World world(mesh);
    for (const double off : {-40.0, -5.0, 0.0, 1e-9, 5.0, 40.0}) {
      const SatellitePaths paths = world.trace({0, 0, 2}, direction(180 + off, 30));
      ASSERT_EQ(paths.paths.size(), 2u) << off;
      EXPECT_NEAR(paths.paths[1].excess_m, detour({0, 0, 2}, paths.paths[1].point, direction(180 + off, 30)),
                  1e-9);
    }
  }
  // A tall building behind a low one, with a common wall: only the part above the low roof reflects.
  Mesh after;
  append(after, {-100, 20, 0}, {100, 30, 10});
  append(after, {-100, 30, 0}, {100, 40, 100});
  const World world(after);
  // At 25 deg the leg passes the low facade at 2 + 20 tan(el) = 11.3 m, over its roof of 10 m; at 14.2 deg
  // at 7.1 m.
  const SatellitePaths high = world.trace({0, 0, 2}, direction(180, 25));
  ASSERT_EQ(high.paths.size(), 2u);
  EXPECT_NEAR(high.paths[1].excess_m, 60 * std::cos(geodesy::radians(25)), 1e-9)
      << "from the tall one's wall";
  const SatellitePaths low = world.trace({0, 0, 2}, direction(180, 14.2));
  ASSERT_EQ(low.paths.size(), 2u);
  EXPECT_NEAR(low.paths[1].excess_m, 40 * std::cos(geodesy::radians(14.2)), 1e-9) << "from the low facade";
}

// Both ends of a path may be exchanged. Closed form: seen from a far source at S the wall shows the image
// antenna; |S - image| - |S - antenna| is the excess path, to 2 h^2 / |S| = 40 um for a source 20,000 km
// away.
TEST(OneWall, IsReciprocal) {
  Mesh mesh;
  append(mesh, {-60, 15, 0}, {70, 30, 90}, 0.2);
  const World world(mesh);
  const auto wall_normal = Eigen::AngleAxisd(0.2, Vector3d::UnitZ()) * -Vector3d::UnitY();
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> azimuth(100, 260), elevation(5, 70), update_instances(-8, 8);
  int paths_seen = 0;
  for (int i = 0; i < 500; ++i) {
    const Vector3d antenna(update_instances(random), update_instances(random) - 15, 2),
        s = direction(azimuth(random), elevation(random));
    for (const Path& path : world.trace(antenna, s).paths) {
      if (path.kind == PathKind::Direct) continue;
      ++paths_seen;
      const Vector3d source = antenna + 2e7 * s;
      const double height = wall_normal.dot(antenna - path.point);
      const Vector3d image = antenna - 2 * height * wall_normal;
      EXPECT_NEAR((source - image).norm() - (source - antenna).norm(), path.excess_m, kMillimetre);
      // The ray from the satellite hits the wall in the same point, and continues to the antenna.
      const auto hit = world.scene.cast({path.point + 500 * s, -s});
      ASSERT_TRUE(hit);
      EXPECT_NEAR(hit->range_m, 500, kMillimetre);
      const Vector3d onward = -s + 2 * s.dot(hit->normal) * hit->normal;
      EXPECT_NEAR((path.point + (antenna - path.point).norm() * onward - antenna).norm(), 0, kMillimetre);
    }
  }
  EXPECT_GT(paths_seen, 300);
}

// Along a wall the scattering centre is fixed for a piece, and another on the next. Ideal walls have none.
TEST(RoughWall, HasSomethingThatLeadsBesideTheMirrorsPoint) {
  Mesh mesh;
  append(mesh, {-5'000, 31, 0}, {5'000, 41, 300});
  append_sheet(mesh, {-5'000, -100, 0}, {10'000, 0, 0}, {0, 130, 0}, Surface::Terrain);
  PropagationOptions options;
  options.ground_reflection = true;
  options.diffuse = true;
  options.scattering.rays = 8;
  const World rough(mesh, options);
  options.scattering.glint_sigma = 0;
  const World flat(mesh, options);
  const Vector3d s = direction(170, 30);
  double squares = 0;
  int pieces = 0, stayed = 0;
  for (double x = -4'000; x < 4'000; x += 8) {
    const Path* before = nullptr;
    const SatellitePaths here = rough.trace({x, 11, 2}, s), next = rough.trace({x + 0.1, 11, 2}, s);
    for (const SatellitePaths* paths : {&here, &next}) {
      for (const Path& path : paths->paths) {
        if (path.kind != PathKind::Reflected || path.order != 1) continue;
        if (path.arrival.z() < 0) {
          EXPECT_EQ(path.scattering_offset, Vector3d::Zero()) << "the ground";
          continue;
        }
        EXPECT_NEAR(path.scattering_offset.dot(path.arrival), 0, 1e-12);
        if (before != nullptr) {
          stayed += (path.scattering_offset - before->scattering_offset).norm() < 1e-3 ? 1 : 0;
        } else {
          squares += path.scattering_offset.squaredNorm() / 2;
          ++pieces;
        }
        before = &path;
      }
    }
    for (const Path& path : flat.trace({x, 11, 2}, s).paths)
      EXPECT_EQ(path.scattering_offset, Vector3d::Zero());
  }
  ASSERT_GE(pieces, 1'000);
  EXPECT_NEAR(std::sqrt(squares / pieces), 0.25, 0.02);
  EXPECT_GT(stayed, 0.95 * pieces);
}

TEST(Ground, ReflectsOnlyWhenAsked) {
  Mesh mesh;
  append_sheet(mesh, {-100, -100, 1}, {200, 0, 0}, {0, 200, 0}, Surface::Terrain);
  const Vector3d antenna(4, -6, 3), s = direction(33, 40);
  EXPECT_EQ(World(mesh).trace(antenna, s).visibility, Visibility::LOS);
  PropagationOptions options;
  options.ground_reflection = true;
  const SatellitePaths paths = World(mesh, options).trace(antenna, s);
  ASSERT_EQ(paths.paths.size(), 2u);
  EXPECT_NEAR(paths.paths[1].excess_m, 2 * 2 * std::sin(geodesy::radians(40)), 1e-9);  // 2 h sin(elevation)
  EXPECT_NEAR((paths.paths[1].arrival - direction(33, -40)).norm(), 0, 1e-12);
}

TEST(Foliage, BlocksAndDoesNotReflect) {
  Mesh mesh;
  canyon::test::append_box(mesh, "tree", Surface::Foliage, Material::Wood, {-50, 20, 0}, {50, 30, 50});
  const World world(mesh);
  EXPECT_EQ(world.trace({0, 0, 2}, direction(180, 30)).visibility, Visibility::LOS);
  EXPECT_EQ(world.trace({0, 0, 2}, direction(0, 30)).visibility, Visibility::Blocked);
}

// ---- a corner

TEST(Corner, GivesTwoFirstOrderPaths) {
  // Walls 12 m east and 20 m north; the satellite in the south-west.
  Mesh mesh;
  append(mesh, {-300, 20, 0}, {12, 40, 400});
  append(mesh, {12, -300, 0}, {30, 40, 400});
  const World world(mesh);
  const Vector3d antenna(0, 0, 2);
  for (const double azimuth : {200.0, 225.0, 230.0, 250.0}) {
    for (const double elevation : {10.0, 35.0, 60.0}) {
      const Vector3d s = direction(azimuth, elevation);
      // Reflection points: (-20 s_x / s_y, 20) must be west of 12; (12, -12 s_y / s_x) must be south of 20.
      // Both are.
      const SatellitePaths paths = world.trace(antenna, s);
      ASSERT_EQ(paths.paths.size(), 3u) << azimuth;
      EXPECT_EQ(paths.visibility, Visibility::LOSMultipath);
      const double north = 2 * 20 * -s.y(), east = 2 * 12 * -s.x();
      EXPECT_NEAR(paths.paths[1].excess_m, std::min(north, east), 1e-9) << "by excess path";
      EXPECT_NEAR(paths.paths[2].excess_m, std::max(north, east), 1e-9);
    }
  }
}

// ---- a street canyon, against an image construction in this file

struct Block {
  Vector3d min, max;
  /// Whether the half-line (or segment of `length`) enters the block: slab test in doubles.
  [[nodiscard]] bool hides(const Vector3d& from, const Vector3d& towards, double length = 1e9) const {
    double enter = 1e-7, leave = length - 1e-7;
    for (int k = 0; k < 3; ++k) {
      double a = (min[k] - from[k]) / towards[k], b = (max[k] - from[k]) / towards[k];
      if (a > b) std::swap(a, b);
      enter = std::max(enter, a);
      leave = std::min(leave, b);
    }
    return enter < leave;
  }
};

TEST(StreetCanyon, AgreesWithTheImageConstructionWithinAMillimetre) {
  const Block south{{-150, -40, 0}, {180, -9, 28}}, north{{-130, 11, 0}, {160, 35, 45}};
  Mesh mesh;
  append(mesh, south.min, south.max);
  append(mesh, north.min, north.max);
  const World world(mesh);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> x(-120, 150), y(-8, 10), z(1, 20), azimuth(0, 360), elevation(3, 85);
  int counts[4] = {0, 0, 0, 0}, reflections = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Vector3d antenna(x(random), y(random), z(random));
    const Vector3d s = direction(azimuth(random), elevation(random));

    struct Image {
      double excess;
      Vector3d point;
    };
    std::vector<Image> expected;
    struct Wall {
      double y, facing;
      Block block;
    };
    bool too_close_to_an_edge = false;
    for (const Wall& wall : {Wall{-9, 1, south}, Wall{11, -1, north}}) {
      if (wall.facing * s.y() <= std::cos(geodesy::radians(89))) continue;
      const Vector3d image(antenna.x(), 2 * wall.y - antenna.y(), antenna.z());
      const double t = (wall.y - image.y()) / s.y();
      const Vector3d point = image + t * s;
      if ((point - antenna).norm() > 300) continue;
      for (const double edge :
           {point.x() - wall.block.min.x(), point.x() - wall.block.max.x(), point.z() - wall.block.max.z()}) {
        too_close_to_an_edge |= std::abs(edge) < kMillimetre;
      }
      if (point.x() < wall.block.min.x() || point.x() > wall.block.max.x() || point.z() < 0 ||
          point.z() > wall.block.max.z()) {
        continue;
      }
      const Vector3d leg = point - antenna;
      if (south.hides(antenna, leg.normalized(), leg.norm()) ||
          north.hides(antenna, leg.normalized(), leg.norm())) {
        continue;
      }
      const Block& other = wall.facing > 0 ? north : south;
      if (other.hides(point, s)) continue;
      expected.push_back({detour(antenna, point, s), point});
    }
    if (too_close_to_an_edge) continue;
    std::sort(expected.begin(), expected.end(),
              [](const Image& a, const Image& b) { return a.excess < b.excess; });
    const bool direct = !south.hides(antenna, s) && !north.hides(antenna, s);

    const SatellitePaths paths = world.trace(antenna, s);
    ++counts[static_cast<int>(paths.visibility)];
    ASSERT_EQ(paths.paths.size(), expected.size() + (direct ? 1 : 0))
        << antenna.transpose() << " towards " << s.transpose();
    const std::size_t first = direct ? 1 : 0;
    if (direct) {
      EXPECT_EQ(paths.paths[0].kind, PathKind::Direct);
    }
    for (std::size_t k = 0; k < expected.size(); ++k) {
      ++reflections;
      EXPECT_EQ(paths.paths[first + k].kind, PathKind::Reflected);
      EXPECT_NEAR(paths.paths[first + k].excess_m, expected[k].excess, kMillimetre);
      EXPECT_NEAR((paths.paths[first + k].point - expected[k].point).norm(), 0, kMillimetre);
      EXPECT_NEAR((paths.paths[first + k].arrival - (expected[k].point - antenna).normalized()).norm(), 0,
                  1e-9);
    }
  }
  for (const int count : counts) EXPECT_GT(count, 500) << "every visibility is met";
  EXPECT_GT(reflections, 5'000);
}

// ---- the paper's mirror model

TEST(MirrorModel, FollowsThePapersEquation) {
  // m = d (1 + sin(pi/2 - 2 theta)) = 2 d cos^2(theta).
  for (const double elevation : {0.0, 0.3, 0.7, 1.2, geodesy::kPi / 2}) {
    EXPECT_NEAR(mirror_excess_m(50, elevation), 2 * 50 * std::cos(elevation) * std::cos(elevation), 1e-12);
  }
}

// Algorithm 2, case by case.
TEST(MirrorModel, FollowsThePapersAlgorithm) {
  Mesh mesh;
  append(mesh, {-100, 24, 0}, {100, 34, 60});   // north, 20 m
  append(mesh, {-100, -16, 0}, {100, -6, 20});  // south, 10 m
  const Vector3d antenna(-9, 4, 2);
  // Direct ray blocked in the south (20 m of height is 60.9 deg), mirror ray hits in the north: NLOS.
  const double d = 20 / std::cos(geodesy::radians(40));
  SatellitePaths paths = World(mesh, mirror()).trace(antenna, direction(180, 40));
  EXPECT_EQ(paths.visibility, Visibility::NLOS);
  ASSERT_EQ(paths.paths.size(), 1u);
  EXPECT_EQ(paths.paths[0].kind, PathKind::Reflected);
  EXPECT_NEAR(paths.paths[0].excess_m, d * (1 + std::sin(geodesy::kPi / 2 - 2 * geodesy::radians(40))), 1e-6);
  EXPECT_TRUE(paths.paths[0].arrival.isApprox(direction(0, 40), 1e-12))
      << "azimuth + 180 deg, same elevation";
  EXPECT_TRUE(paths.paths[0].point.isApprox(antenna + d * direction(0, 40), 1e-6));
  EXPECT_NEAR(paths.tracked_excess_m(), paths.paths[0].excess_m, 0);

  // The mirror ray's range is limited (26.1 m): not received.
  EXPECT_EQ(World(mesh, mirror(26.0)).trace(antenna, direction(180, 40)).visibility, Visibility::Blocked);
  EXPECT_EQ(World(mesh, mirror(26.2)).trace(antenna, direction(180, 40)).visibility, Visibility::NLOS);
  // Line of sight: no multipath in this model, though the wall in the north would reflect.
  paths = World(mesh, mirror()).trace(antenna, direction(180, 65));
  EXPECT_EQ(paths.visibility, Visibility::LOS);
  EXPECT_EQ(paths.paths.size(), 1u);
  // Blocked at the street's other end and the mirror ray free: not received.
  Mesh lone;
  append(lone, {-100, 24, 0}, {100, 34, 60});
  EXPECT_EQ(World(lone, mirror()).trace(antenna, direction(0, 40)).visibility, Visibility::Blocked);
}

// A wall at distance h whose normal is `off` from the satellite's azimuth. The mirror ray has the length d =
// h / (cos(el) cos(off)), m = 2 d cos^2(el) = 2 h cos(el) / cos(off); the specular excess path is 2 h cos(el)
// cos(off). The models agree if the wall faces the satellite and differ by the factor cos^2(off) otherwise.
TEST(MirrorModel, AgreesWithSpecularWhereTheWallFacesTheSatellite) {
  Mesh mesh;
  append(mesh, {-1'000, 20, 0}, {1'000, 30, 300});
  append(mesh, {-1'000, -12, 0}, {1'000, -10, 12});  // hides the direct ray, not the reflected one
  const World specular(mesh), mirrored(mesh, mirror());
  const Vector3d antenna(0, 0, 2);
  for (const double off_deg : {0.0, 10.0, -35.0, 60.0}) {
    const double off = geodesy::radians(off_deg);
    for (const double elevation_deg : {14.0, 18.0, 24.0}) {
      const double horizontal = 2 * 20 * std::cos(geodesy::radians(elevation_deg));
      const Vector3d s = direction(180 + off_deg, elevation_deg);
      const SatellitePaths a = specular.trace(antenna, s), b = mirrored.trace(antenna, s);
      ASSERT_EQ(a.visibility, Visibility::NLOS);
      ASSERT_EQ(b.visibility, Visibility::NLOS);
      EXPECT_NEAR(a.paths[0].excess_m, horizontal * std::cos(off), kMillimetre);
      EXPECT_NEAR(b.paths[0].excess_m, horizontal / std::cos(off), kMillimetre);
      if (off_deg == 0.0) {
        EXPECT_NEAR(a.paths[0].excess_m, b.paths[0].excess_m, kMillimetre);
        EXPECT_NEAR((a.paths[0].point - b.paths[0].point).norm(), 0, kMillimetre);
      } else {
        EXPECT_GT(b.paths[0].excess_m - a.paths[0].excess_m, 0.5);
      }
    }
  }
}

// ---- movable instances

TEST(Instances, ReflectUnderTheirPoseAndBlock) {
  Mesh bus;
  canyon::test::append_box(bus, "bus", Surface::Vehicle, Material::Metal, {-6, -1.25, 0}, {6, 1.25, 4});
  Mesh empty;
  RayScene scene(empty);
  const Propagator propagator(empty, scene);
  const raytrace::InstanceId id = scene.add_instance(bus);
  const auto trace = [&](const Vector3d& s) {
    SatellitePaths result;
    propagator.trace({0, 0, 2}, {&s, 1}, {&result, 1});
    return result;
  };
  const Vector3d south = direction(180, 15);
  scene.commit();
  EXPECT_EQ(trace(south).visibility, Visibility::LOS);

  // North of the antenna, side towards it: wall 5 m away.
  scene.set_pose(id, Isometry3d(Eigen::Translation3d(0, 6.25, 0)));
  scene.commit();
  SatellitePaths paths = trace(south);
  ASSERT_EQ(paths.visibility, Visibility::LOSMultipath);
  EXPECT_NEAR(paths.paths[1].excess_m, 2 * 5 * std::cos(geodesy::radians(15)), 1e-9);
  EXPECT_EQ(paths.paths[1].instance, id);
  EXPECT_LT(paths.paths[1].triangle, 12u);
  EXPECT_TRUE(paths.paths[1].point.isApprox(Vector3d(0, 5, 2 + 5 * std::tan(geodesy::radians(15))), 1e-9));
  EXPECT_EQ(trace(direction(0, 15)).visibility, Visibility::Blocked) << "and it hides what is behind it";

  // Rotated by 10 deg about a pivot: normal (sin 10, -cos 10), closed form 2 h (n . s).
  const double yaw = geodesy::radians(10);
  scene.set_pose(id, Eigen::Translation3d(0, 6.25, 0) * Eigen::AngleAxisd(yaw, Vector3d::UnitZ()));
  scene.commit();
  paths = trace(south);
  ASSERT_EQ(paths.paths.size(), 2u);
  const Vector3d normal(std::sin(yaw), -std::cos(yaw), 0);
  const double height = normal.dot(Vector3d(0, 0, 0) - (Vector3d(0, 6.25, 0) + 1.25 * normal));
  EXPECT_NEAR(paths.paths[1].excess_m, 2 * height * normal.dot(south), 1e-9);
  EXPECT_NEAR((paths.paths[1].arrival - (south - 2 * south.dot(normal) * normal)).norm(), 0, 1e-12);

  scene.set_visible(id, false);
  scene.commit();
  EXPECT_EQ(trace(south).visibility, Visibility::LOS);
  scene.set_visible(id, true);
  scene.commit();
  EXPECT_EQ(trace(south).visibility, Visibility::LOSMultipath);
  scene.remove_instance(id);
  scene.commit();
  EXPECT_EQ(trace(south).visibility, Visibility::LOS);
}

TEST(Instances, ABusHidesAReflectionFromAWall) {
  Mesh mesh;
  append(mesh, {-100, 20, 0}, {100, 30, 100});
  World world(mesh);
  Mesh bus;
  canyon::test::append_box(bus, "bus", Surface::Vehicle, Material::Metal, {-6, -1, 0}, {6, 1, 6});
  const raytrace::InstanceId id = world.scene.add_instance(bus);
  const Vector3d s = direction(180, 10);  // the leg is 2 + 10 tan 10 = 3.8 m high half way
  EXPECT_EQ(world.trace({0, 0, 2}, s).paths.size(), 2u);
  world.scene.set_pose(id, Isometry3d(Eigen::Translation3d(0, 10, 0)));
  world.scene.commit();
  const SatellitePaths paths = world.trace({0, 0, 2}, s);
  ASSERT_EQ(paths.paths.size(), 2u);
  EXPECT_EQ(paths.paths[1].instance, id) << "the bus reflects instead";
  EXPECT_NEAR(paths.paths[1].excess_m, 2 * 9 * std::cos(geodesy::radians(10)), 1e-9);
}

// ---- many satellites and threads in parallel

// Facets are cached for successive nearby antennas. A new thread has an empty cache.
TEST(Propagator, DoesNotDependOnTheAntennaBefore) {
  city::SyntheticCityOptions city;
  city.blocks_east = city.blocks_north = 4;
  PropagationOptions options;
  options.reflection_order = 2;
  options.ground_reflection = true;
  const World world(city::synthetic_city(city).mesh, options);
  std::vector<Vector3d> sky;
  for (int azimuth = 0; azimuth < 360; azimuth += 20) sky.push_back(direction(azimuth, 15 + azimuth / 6.0));
  const auto trace = [&](const Vector3d& antenna) {
    std::vector<SatellitePaths> result(sky.size());
    world.propagator.trace(antenna, sky, result);
    return result;
  };
  std::size_t paths = 0;
  for (int step = 0; step < 60; ++step) {
    // Along a street by 0.3 to 3 m, with a jump every now and then.
    const double along = 0.3 * (1 + step % 10) * step + (step % 17 == 0 ? 40 : 0);
    const Vector3d antenna(-70 + std::fmod(along, 140), 3 + 0.05 * step, 2);
    const std::vector<SatellitePaths> here = trace(antenna);
    std::vector<SatellitePaths> fresh;
    std::thread([&] { fresh = trace(antenna); }).join();
    for (std::size_t k = 0; k < sky.size(); ++k) {
      ASSERT_EQ(here[k].paths.size(), fresh[k].paths.size()) << step;
      for (std::size_t p = 0; p < here[k].paths.size(); ++p) {
        EXPECT_EQ(here[k].paths[p].excess_m, fresh[k].paths[p].excess_m);
        EXPECT_EQ(here[k].paths[p].reflector, fresh[k].paths[p].reflector);
        ++paths;
      }
    }
  }
  EXPECT_GT(paths, 1'000u);
}

TEST(Propagator, AnswersAlikeForOneAndForManyAndOnThreads) {
  const city::City city = city::synthetic_city({});
  World world(city.mesh);
  Mesh bus;
  canyon::test::append_box(bus, "bus", Surface::Vehicle, Material::Metal, {-6, -1, 0}, {6, 1, 4});
  for (const double x : {10.0, 60.0}) {
    world.scene.set_pose(world.scene.add_instance(bus), Isometry3d(Eigen::Translation3d(x, 4, 0)));
  }
  world.scene.commit();
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> along(-150, 150), azimuth(0, 360), elevation(5, 85);
  std::vector<Vector3d> sky, points;
  for (int i = 0; i < 40; ++i) sky.push_back(direction(azimuth(random), elevation(random)));
  for (int i = 0; i < 60; ++i) points.emplace_back(along(random), 0.5, 2);
  std::vector<std::vector<SatellitePaths>> alone(points.size(), std::vector<SatellitePaths>(sky.size()));
  for (std::size_t p = 0; p < points.size(); ++p) {
    for (std::size_t i = 0; i < sky.size(); ++i) alone[p][i] = world.trace(points[p], sky[i]);
  }
  std::array<int, 3> wrong{};
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < wrong.size(); ++t) {
    threads.emplace_back([&, t] {
      std::vector<SatellitePaths> result(sky.size());
      for (std::size_t p = 0; p < points.size(); ++p) {
        world.propagator.trace(points[p], sky, result);
        for (std::size_t i = 0; i < sky.size(); ++i) {
          const SatellitePaths &a = alone[p][i], &b = result[i];
          bool same = a.visibility == b.visibility && a.paths.size() == b.paths.size();
          for (std::size_t k = 0; same && k < a.paths.size(); ++k) {
            same = a.paths[k].excess_m == b.paths[k].excess_m && a.paths[k].point == b.paths[k].point &&
                   a.paths[k].triangle == b.paths[k].triangle && a.paths[k].instance == b.paths[k].instance;
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
}  // namespace canyon::propagation::propagator_test
