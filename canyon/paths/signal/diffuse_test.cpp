#include "canyon/paths/propagation/diffuse.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/paths/signal/radio_materials.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/bench_city.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::signal {
namespace {

using city::Material;
using city::Mesh;
using city::Surface;
using Eigen::Vector3d;
using geodesy::kPi;
using geodesy::radians;
using raytrace::RayScene;

/// Towards a satellite, azimuth from north clockwise.
Vector3d direction(double azimuth_deg, double elevation_deg) {
  return geodesy::enu_from_azimuth_elevation(radians(azimuth_deg), radians(elevation_deg));
}

/// A rectangle from `corner` along `u` and `v`; its front is to the side of u x v.
void append_sheet(Mesh& mesh, const Vector3d& corner, const Vector3d& u, const Vector3d& v,
                  Surface surface = Surface::Building) {
  city::append_object(mesh, "sheet", surface, Material::Concrete,
                      {corner, corner + u, corner + u + v, corner + v}, {{0, 1, 2}, {0, 2, 3}});
}

/// The effective roughness model alone.
propagation::DiffuseOptions without_strengths() {
  propagation::DiffuseOptions options;
  options.strength_sigma_db = options.strength_median_db = 0;
  return options;
}

/// All paths over one facade, with the highest accuracy.
propagation::DiffuseOptions everything() {
  propagation::DiffuseOptions options = without_strengths();
  options.wall_reflectance = 0.3;
  options.bounces = 1;
  options.rays = 4096;
  options.lowest_elevation_rad = -kPi / 2;
  options.min_power_db = -100;
  options.max_paths = 64;
  options.max_range_m = 100'000;
  return options;
}

struct World {
  Mesh mesh;
  RayScene scene;
  propagation::DiffuseScattering scattering;
  World(Mesh m, const propagation::DiffuseOptions& options)
      : mesh(std::move(m)), scene(mesh), scattering(mesh, scene, options) {}
  [[nodiscard]] std::vector<propagation::DiffusePath> trace(const Vector3d& antenna,
                                                            const Vector3d& satellite) const {
    const bool wanted = true;
    std::vector<propagation::DiffusePath> result;
    scattering.trace(antenna, {&satellite, 1}, {&wanted, 1}, {&result, 1});
    return result;
  }
};

double total_power(const std::vector<propagation::DiffusePath>& paths) {
  double sum = 0;
  for (const propagation::DiffusePath& path : paths) sum += path.power;
  return sum;
}
double mean_excess(const std::vector<propagation::DiffusePath>& paths) {
  double sum = 0;
  for (const propagation::DiffusePath& path : paths) sum += path.power * path.excess_m;
  return sum / total_power(paths);
}

TEST(DiffuseScattering, TiesOfPowerDoNotHangOnTheLastDigit) {
  // Panels of one wall, whose normals differ in their last digits: many classes have equal power.
  Mesh mesh;
  const Vector3d along = direction(100, 0);
  for (int i = -20; i < 20; ++i)
    append_sheet(mesh, Vector3d(3, 12, 0) + 5.1 * i * along, 5 * along, {0, 0, 30});
  propagation::DiffuseOptions options = everything();
  options.rays = 512;
  options.class_m = 2;
  options.max_paths = 4;
  const World world(mesh, options);
  int others = 0;
  for (int k = 0; k < 400; ++k) {
    const Vector3d satellite = direction(130 + 0.3 * k, 10 + 0.1 * k);
    const Vector3d next = satellite.unaryExpr([](double x) { return std::nextafter(x, 2.0); });
    const auto here = world.trace({3, 0, 2}, satellite), there = world.trace({3, 0, 2}, next);
    others +=
        !std::equal(here.begin(), here.end(), there.begin(), there.end(), [](const auto& a, const auto& b) {
          return a.bin == b.bin && a.triangle == b.triangle && (a.point - b.point).norm() < 1e-6;
        });
  }
  EXPECT_EQ(others, 0);
}

TEST(DiffuseScattering, EndlessWallFillsHalfTheView) {
  // Half of all directions end on the wall: 2 pi S^2 rho cos(theta_i) / pi, at any distance.
  Mesh mesh;
  append_sheet(mesh, {-20'000, 5, -20'000}, {40'000, 0, 0}, {0, 0, 40'000});
  propagation::DiffuseOptions options = everything();
  options.class_m = 100'000;
  options.scattering_coefficient = 0.6;
  options.wall_reflectance = 0.7;
  const World world(mesh, options);
  double worst = 0;
  for (const double elevation : {1.0, 30.0, 60.0, 85.0}) {
    for (const double azimuth : {180.0, 200.0, 250.0}) {
      const Vector3d satellite = direction(azimuth, elevation);
      const double power = total_power(world.trace({3, 0, 2}, satellite));
      const double expected = 2 * 0.6 * 0.6 * 0.7 * -satellite.y();
      worst = std::max(worst, std::abs(power / expected - 1));
    }
  }
  std::printf("largest relative difference %.1e\n", worst);
  EXPECT_LT(worst, 2e-3);
  EXPECT_THAT(world.trace({3, 0, 2}, direction(10, 40)), testing::IsEmpty());  // the wall's other side is lit
}

/// The power that the wall [-half, half] x {y} x [0, height], front to the south, scatters to the antenna, by
/// classes of detour: a midpoint rule of the formula over its area. `lit(point)` is false in shadow.
struct ByArea {
  std::vector<double> power, power_excess;
  template <typename Lit>
  ByArea(const propagation::DiffuseOptions& o, const Vector3d& antenna, const Vector3d& s, double half,
         double y, double height, const Lit& lit) {
    const double step = 0.2;
    const Vector3d normal(0, -1, 0);
    const double cos_lit = normal.dot(s);
    for (double x = -half + step / 2; x < half; x += step) {
      for (double z = step / 2; z < height; z += step) {
        const Vector3d point(x, y, z);
        if (!lit(point)) continue;
        const double r = (point - antenna).norm();
        const Vector3d towards = (point - antenna) / r;
        const double cos_seen = -normal.dot(towards);
        const double p = o.scattering_coefficient * o.scattering_coefficient * o.wall_reflectance.value() *
                         cos_lit * cos_seen / kPi * step * step / (r * r);
        const double excess = r - s.dot(point - antenna);
        const auto bin = static_cast<std::size_t>(excess / o.class_m);
        if (power.size() <= bin) power.resize(bin + 1), power_excess.resize(bin + 1);
        power[bin] += p;
        power_excess[bin] += p * excess;
      }
    }
  }
  [[nodiscard]] double total() const {
    double sum = 0;
    for (const double p : power) sum += p;
    return sum;
  }
  [[nodiscard]] double mean_excess_m() const {
    double sum = 0;
    for (const double p : power_excess) sum += p;
    return sum / total();
  }
};

TEST(DiffuseScattering, WallIsThatOfAQuadratureOverItsArea) {
  Mesh mesh;
  append_sheet(mesh, {-60, 12, 0}, {120, 0, 0}, {0, 0, 40});
  const propagation::DiffuseOptions options = everything();
  const World world(mesh, options);
  const Vector3d antenna(7, 0, 2);
  double worst_total = 0, worst_mean = 0, worst_class = 0;
  for (const Vector3d& s : {direction(180, 20), direction(215, 45), direction(120, 70), direction(260, 10)}) {
    const ByArea area(options, antenna, s, 60, 12, 40, [](const Vector3d&) { return true; });
    const std::vector<propagation::DiffusePath> paths = world.trace(antenna, s);
    ASSERT_FALSE(paths.empty());
    worst_total = std::max(worst_total, std::abs(total_power(paths) / area.total() - 1));
    worst_mean = std::max(worst_mean, std::abs(mean_excess(paths) - area.mean_excess_m()));
    for (const propagation::DiffusePath& path : paths) {
      ASSERT_LT(path.bin, area.power.size());
      worst_class = std::max(worst_class, std::abs(path.power - area.power[path.bin]) / area.total());
      // A weak class consists of few rays.
      const double tolerance = area.power[path.bin] > 0.03 * area.total() ? 0.5 : 4;
      EXPECT_NEAR(path.excess_m, area.power_excess[path.bin] / area.power[path.bin], tolerance) << path.bin;
    }
  }
  std::printf("total %.1e, mean excess %.3f m, a class by %.1e of the total\n", worst_total, worst_mean,
              worst_class);
  EXPECT_LT(worst_total, 0.02);
  EXPECT_LT(worst_mean, 0.1);
  EXPECT_LT(worst_class, 0.02);
}

TEST(DiffuseScattering, PatchScattersItsShareOfTheIncidentPower) {
  // Power that crosses a hemisphere of 100 m around a square of 20 m, over the incident power: S^2 rho.
  // Fluence instead of flux adds at most (14 / 100)^2 / 2 = 1 %; few rays and points are within another 1 %.
  Mesh mesh;
  append_sheet(mesh, {-10, 0, -10}, {20, 0, 0}, {0, 0, 20});
  const propagation::DiffuseOptions options = everything();
  const World world(mesh, options);
  const double fraction = 0.4 * 0.4 * 0.3, radius = 100;
  const std::array<Vector3d, 2> sky = {direction(180, 0), direction(140, 40)};
  const std::array<bool, 2> wanted = {true, true};
  std::array<std::vector<propagation::DiffusePath>, 2> paths;
  std::array<double, 2> scattered = {0, 0};
  constexpr int kPositions = 2000;
  for (int k = 0; k < kPositions; ++k) {
    const double y = -(k + 0.5) / kPositions, across = std::sqrt(1 - y * y), rotation = k * 2.399963229728653;
    const Vector3d point = radius * Vector3d(across * std::cos(rotation), y, across * std::sin(rotation));
    world.scattering.trace(point, sky, wanted, paths);
    for (std::size_t i = 0; i < 2; ++i)
      scattered[i] += total_power(paths[i]) * radius * radius * 2 * kPi / kPositions;
    if (k % 100 != 0) continue;
    world.scattering.trace(-point, sky, wanted, paths);  // behind it
    EXPECT_THAT(paths, testing::Each(testing::IsEmpty()));
  }
  for (std::size_t i = 0; i < 2; ++i) {
    const double ratio = scattered[i] / (fraction * 400 * -sky[i].y());
    std::printf("scattered over S^2 rho of the incident power: %.4f\n", ratio);
    EXPECT_NEAR(ratio, 1, 0.015);
  }
}

TEST(DiffuseScattering, ShadowedPatchesGiveNothing) {
  // A deck over half of the street, which shades the wall by geometry.
  Mesh mesh;
  append_sheet(mesh, {-60, 12, 0}, {120, 0, 0}, {0, 0, 25});
  append_sheet(mesh, {0, -200, 30}, {100, 0, 0}, {0, 208, 0});
  const propagation::DiffuseOptions options = everything();
  const World world(mesh, options);
  const Vector3d antenna(-4, 0, 2);
  // The shadow's edge is accurate to half a cell and half a degree (FacadeLight): over many satellites that
  // averages out.
  double found = 0, expected = 0, found_m = 0, expected_m = 0, unshadowed = 0;
  int satellites = 0;
  for (double rotation = 0; rotation < 30; rotation += 1.3, ++satellites) {
    const Vector3d s = direction(165 + rotation / 2, 35 + rotation / 2);
    const auto height_over_deck = [&](const Vector3d& point) -> Vector3d {
      return point + s * ((30 - point.z()) / s.z());
    };
    const auto lit_within = [&](const Vector3d& point, double slack_m) {
      const Vector3d above = height_over_deck(point);
      return !(above.x() >= slack_m && above.x() <= 100 && above.y() >= -200 && above.y() <= 8 - slack_m);
    };
    const auto lit = [&](const Vector3d& point) { return lit_within(point, 0); };
    const ByArea area(options, antenna, s, 60, 12, 25, lit);
    const ByArea free(options, antenna, s, 60, 12, 25, [](const Vector3d&) { return true; });
    const std::vector<propagation::DiffusePath> paths = world.trace(antenna, s);
    EXPECT_NEAR(total_power(paths) / area.total(), 1, 0.12);
    found += total_power(paths);
    expected += area.total();
    found_m += mean_excess(paths);
    expected_m += area.mean_excess_m();
    unshadowed += free.total();
    for (const propagation::DiffusePath& path : paths) EXPECT_TRUE(lit_within(path.point, 3.5));
  }
  std::printf("power %.4f, excess %.2f m\n", found / expected, (found_m - expected_m) / satellites);
  EXPECT_LT(expected, 0.9 * unshadowed);
  EXPECT_NEAR(found / expected, 1, 0.02);
  EXPECT_NEAR((found_m - expected_m) / satellites, 0, 0.3);
}

TEST(DiffuseScattering, WayIsDirectGeometry) {
  Mesh mesh;
  canyon::test::append_box(mesh, "tower", Surface::Building, Material::Glass, {-40, 20, 0}, {50, 30, 60});
  propagation::DiffuseOptions options = everything();
  options.rays = 128;
  options.class_m = 0.1;  // one path in nearly each
  const World world(mesh, options);
  const Vector3d antenna(1, -2, 1.5), s = direction(200, 35);
  const std::vector<propagation::DiffusePath> paths = world.trace(antenna, s);
  ASSERT_GE(paths.size(), 10);
  int alone = 0;
  const double one = 0.4 * 0.4 * 0.3 * -s.y() * 4 / 128;  // S^2 rho cos(theta_i) (4 pi / 128) / pi
  for (const propagation::DiffusePath& path : paths) {
    EXPECT_NEAR(path.point.y(), 20, 1e-4);
    EXPECT_NEAR((path.point - antenna).normalized().dot(path.arrival), 1, 1e-14);
    EXPECT_NEAR(path.arrival.norm(), 1, 1e-14);
    EXPECT_EQ(path.instance, 0);
    EXPECT_NEAR(mesh.vertices[mesh.triangles[path.triangle][0]].y(), 20, 1e-12);
    EXPECT_EQ(path.bin, static_cast<std::uint32_t>(path.excess_m / 0.1));
    if (path.power > 1.5 * one) continue;
    ++alone;
    EXPECT_NEAR(path.power, one, 1e-12);
    EXPECT_NEAR(path.excess_m, (path.point - antenna).norm() - s.dot(path.point - antenna), 1e-11);
  }
  EXPECT_GE(alone, 10);
  EXPECT_TRUE(std::is_sorted(paths.begin(), paths.end(),
                             [](const auto& a, const auto& b) { return a.excess_m < b.excess_m; }));
}

TEST(DiffuseScattering, RangeAndLowestElevationBoundTheView) {
  Mesh mesh;
  append_sheet(mesh, {-60, 12, -30}, {120, 0, 0}, {0, 0, 60});
  propagation::DiffuseOptions options = everything();
  options.class_m = 0.1;
  options.max_range_m = 15;
  options.lowest_elevation_rad = 0.1;
  const World near(mesh, options);
  const Vector3d antenna(0, 0, 2), s = direction(180, 30);
  const std::vector<propagation::DiffusePath> paths = near.trace(antenna, s);
  ASSERT_FALSE(paths.empty());
  for (const propagation::DiffusePath& path : paths) {
    EXPECT_LE((path.point - antenna).norm(), 15 + 1e-9);
    EXPECT_GE(path.arrival.z(), std::sin(0.1));
  }
  options.max_range_m = 11;
  EXPECT_THAT(World(mesh, options).trace(antenna, s), testing::IsEmpty());
}

TEST(DiffuseScattering, OnlyWantedSatellitesGetPaths) {
  const city::City city = city::synthetic_city({});
  const RayScene scene(city.mesh);
  const propagation::DiffuseScattering scattering(city.mesh, scene);
  const std::vector<Vector3d> sky = bench::spread_sky(50);
  const auto wanted = std::make_unique<bool[]>(sky.size());
  for (std::size_t i = 0; i < sky.size(); ++i) wanted[i] = i % 3 == 0;
  std::vector<std::vector<propagation::DiffusePath>> some(sky.size(),
                                                          std::vector<propagation::DiffusePath>(3)),
      all(sky.size());
  const Vector3d antenna(20, 0.3, 2);
  scattering.trace(antenna, sky, {wanted.get(), sky.size()}, some);
  const auto every = std::make_unique<bool[]>(sky.size());
  std::fill_n(every.get(), sky.size(), true);
  scattering.trace(antenna, sky, {every.get(), sky.size()}, all);
  int with = 0;
  for (std::size_t i = 0; i < sky.size(); ++i) {
    ASSERT_EQ(some[i].size(), wanted[i] ? all[i].size() : 0);
    for (std::size_t k = 0; k < some[i].size(); ++k) {
      EXPECT_EQ(some[i][k].power, all[i][k].power);
      EXPECT_EQ(some[i][k].excess_m, all[i][k].excess_m);
    }
    with += some[i].empty() ? 0 : 1;
  }
  EXPECT_GE(with, 10);
}

TEST(DiffuseScattering, KeepsTheStrongestClasses) {
  // The early cut, before rays are cast, drops the same paths as a late one.
  const city::City city = city::synthetic_city({});
  const RayScene scene(city.mesh);
  const std::vector<Vector3d> sky = bench::spread_sky(50);
  const auto every = std::make_unique<bool[]>(sky.size());
  std::fill_n(every.get(), sky.size(), true);
  const std::span<const bool> wanted(every.get(), sky.size());
  propagation::DiffuseOptions options = without_strengths();
  options.class_m = 7;
  options.min_power_db = -100;
  options.max_paths = 64;
  std::vector<std::vector<propagation::DiffusePath>> all(sky.size()), kept(sky.size());
  int compared = 0, weak = 0, many = 0;
  for (const double min_power_db : {-40.0, -33.0, -27.0}) {
    for (const int max_paths : {1, 3, 6}) {
      propagation::DiffuseOptions limited = options;
      limited.min_power_db = min_power_db;
      limited.max_paths = max_paths;
      for (const Vector3d& antenna : {Vector3d(20, 0.3, 2), Vector3d(0.3, -33, 2), Vector3d(0.3, 0.3, 2)}) {
        propagation::DiffuseScattering(city.mesh, scene, options).trace(antenna, sky, wanted, all);
        propagation::DiffuseScattering(city.mesh, scene, limited).trace(antenna, sky, wanted, kept);
        for (std::size_t i = 0; i < sky.size(); ++i) {
          std::vector<propagation::DiffusePath> expected;
          for (const propagation::DiffusePath& path : all[i]) {
            const bool enough = path.power >= std::pow(10, min_power_db / 10);
            if (enough) expected.push_back(path);
            weak += enough ? 0 : 1;
          }
          std::stable_sort(expected.begin(), expected.end(),
                           [](const auto& a, const auto& b) { return a.power > b.power; });
          if (expected.size() > static_cast<std::size_t>(max_paths)) {
            ++many;
            expected.resize(static_cast<std::size_t>(max_paths));
          }
          std::sort(expected.begin(), expected.end(),
                    [](const auto& a, const auto& b) { return a.excess_m < b.excess_m; });
          ASSERT_EQ(kept[i].size(), expected.size());
          for (std::size_t k = 0; k < expected.size(); ++k) {
            ++compared;
            EXPECT_EQ(kept[i][k].bin, expected[k].bin);
            EXPECT_EQ(kept[i][k].power, expected[k].power);
            EXPECT_EQ(kept[i][k].excess_m, expected[k].excess_m);
            EXPECT_EQ(kept[i][k].point, expected[k].point);
          }
        }
      }
    }
  }
  std::printf("%d paths, %d too weak, %d satellites with too many\n", compared, weak, many);
  EXPECT_GT(compared, 500);
  EXPECT_GT(weak, 100);
  EXPECT_GT(many, 100);
}

TEST(DiffuseScattering, VehiclesScatterTerrainAndFoliageDoNot) {
  const Vector3d antenna(0, 0, 1.5), s = direction(180, 40);
  for (const Surface surface : {Surface::Building, Surface::Vehicle, Surface::Terrain, Surface::Foliage}) {
    Mesh mesh;
    append_sheet(mesh, {-6, 4, 0}, {12, 0, 0}, {0, 0, 3}, surface);
    const bool does = surface == Surface::Building || surface == Surface::Vehicle;
    EXPECT_EQ(!World(mesh, everything()).trace(antenna, s).empty(), does) << static_cast<int>(surface);

    // The same as an instance in an open field, rotated by 180 deg and moved back.
    Mesh own;
    append_sheet(own, {6, -4, 0}, {-12, 0, 0}, {0, 0, 3}, surface);
    World open({}, everything());
    const raytrace::InstanceId first = open.scene.add_instance(own);
    const raytrace::InstanceId id = open.scene.add_instance(own);
    open.scene.remove_instance(first);
    open.scene.set_pose(id, Eigen::Isometry3d(Eigen::AngleAxisd(kPi, Vector3d::UnitZ())));
    open.scene.commit();
    const std::vector<propagation::DiffusePath> paths = open.trace(antenna, s);
    ASSERT_EQ(!paths.empty(), does);
    const std::vector<propagation::DiffusePath> fixed = World(mesh, everything()).trace(antenna, s);
    ASSERT_EQ(paths.size(), fixed.size());
    for (std::size_t k = 0; k < paths.size(); ++k) {
      EXPECT_EQ(paths[k].instance, id);
      EXPECT_LT(paths[k].triangle, own.triangles.size());
      EXPECT_NEAR(paths[k].power, fixed[k].power, 1e-12);
      EXPECT_NEAR(paths[k].excess_m, fixed[k].excess_m, 1e-3);
    }
    // A surface that does not scatter still casts a shadow.
    append_sheet(mesh, {-50, -9, 0}, {100, 0, 0}, {0, 0, 40}, Surface::Foliage);
    EXPECT_THAT(World(mesh, everything()).trace(antenna, s), testing::IsEmpty());
  }
}

TEST(DiffuseScattering, OpenFieldGivesNothing) {
  EXPECT_THAT(World({}, everything()).trace({0, 0, 2}, direction(20, 30)), testing::IsEmpty());
  Mesh ground;
  append_sheet(ground, {-500, -500, 0}, {1000, 0, 0}, {0, 1000, 0}, Surface::Terrain);
  EXPECT_THAT(World(ground, everything()).trace({0, 0, 2}, direction(20, 30)), testing::IsEmpty());
  Mesh mesh;
  append_sheet(mesh, {-60, 12, 0}, {120, 0, 0}, {0, 0, 40});
  propagation::DiffuseOptions smooth = everything(), black = everything();
  smooth.scattering_coefficient = 0;
  black.wall_reflectance = 0;
  for (const propagation::DiffuseOptions& options : {smooth, black})
    EXPECT_THAT(World(mesh, options).trace({0, 0, 2}, direction(180, 30)), testing::IsEmpty());
}

/// Difference of a few rays from 4096: totals of satellites above -35 dB with these.
class Errors {
 public:
  void add(const std::vector<propagation::DiffusePath>& few,
           const std::vector<propagation::DiffusePath>& many) {
    if (total_power(many) < std::pow(10, -3.5)) return;
    if (few.empty()) {
      ++missed_;
      return;
    }
    db_.push_back(std::abs(10 * std::log10(total_power(few) / total_power(many))));
    m_.push_back(std::abs(mean_excess(few) - mean_excess(many)));
  }
  struct Quantiles {
    std::size_t count, missed;
    double db_p50, db_p90, m_p50, m_p90;
  };
  Quantiles quantiles(int rays) {
    std::sort(db_.begin(), db_.end());
    std::sort(m_.begin(), m_.end());
    const std::size_t n = db_.size();
    const Quantiles q = {n, missed_, db_.at(n / 2), db_.at(n * 9 / 10), m_.at(n / 2), m_.at(n * 9 / 10)};
    std::printf(
        "%4d rays, %zu satellites, %zu missed: power p50 %.2f dB p90 %.2f dB, mean excess p50 %.2f m "
        "p90 %.2f m\n",
        rays, q.count, q.missed, q.db_p50, q.db_p90, q.m_p50, q.m_p90);
    return q;
  }

 private:
  std::vector<double> db_, m_;
  std::size_t missed_ = 0;
};

propagation::DiffuseOptions all_classes(int rays) {
  propagation::DiffuseOptions options = without_strengths();
  options.rays = rays;
  options.min_power_db = -100;
  options.max_paths = 64;
  return options;
}

TEST(DiffuseScattering, ConvergesInAStreet) {
  // Two walls 20 m apart, 30 m high, 400 m long; satellites that one of them hides. The low ones light only a
  // strip of 3 m under the roof across the street.
  Mesh mesh;
  canyon::test::append_box(mesh, "north", Surface::Building, Material::Concrete, {-200, 10, 0},
                           {200, 25, 30});
  canyon::test::append_box(mesh, "south", Surface::Building, Material::Concrete, {-200, -25, 0},
                           {200, -10, 30});
  append_sheet(mesh, {-500, -500, 0}, {1000, 0, 0}, {0, 1000, 0}, Surface::Terrain);
  const World fine(mesh, all_classes(4096));
  std::vector<Errors::Quantiles> found;
  for (const int rays : {96, propagation::DiffuseOptions().rays, 1024}) {
    const World coarse(mesh, all_classes(rays));
    Errors errors;
    for (int index = 0; index < 17; ++index) {
      const Vector3d antenna(index - 8, -7 + 14 * std::fmod(index * 0.618, 1), 2);
      for (const double azimuth : {20, 45, 70, 150, 200, 250, 340}) {
        for (const double elevation : {10, 25, 40}) {
          const Vector3d s = direction(azimuth, elevation);
          if (fine.scene.occluded({antenna, s})) errors.add(coarse.trace(antenna, s), fine.trace(antenna, s));
        }
      }
    }
    found.push_back(errors.quantiles(rays));
    ASSERT_GT(found.back().count, 150);
  }
  EXPECT_LT(found[1].db_p50, 0.6);
  EXPECT_LT(found[1].m_p50, 5);
  EXPECT_LE(found[1].missed, found[1].count / 10);
  EXPECT_LT(found[2].db_p50, 0.25);
  EXPECT_LT(found[2].db_p90, 1.5);
  EXPECT_LT(found[2].m_p50, 2);
  EXPECT_EQ(found[2].missed, 0);
}

TEST(DiffuseScattering, ConvergesInTsimShaTsui) {
  CANYON_SHARED_DATA(mesh_file, "hongkong/buildings.dae");
  CANYON_SHARED_DATA(drive, "urbannav-tst-20190428/groundTruth_TST.csv");
  const bench::BenchCity city = bench::bench_city();
  const RayScene scene(city.city.mesh);
  const std::vector<Vector3d> sky = bench::spread_sky(50);
  const auto hidden = std::make_unique<bool[]>(sky.size());
  const std::span<const bool> wanted(hidden.get(), sky.size());
  const propagation::DiffuseScattering fine(city.city.mesh, scene, all_classes(4096));
  std::vector<Errors::Quantiles> found;
  for (const int rays : {96, propagation::DiffuseOptions().rays, 1024}) {
    const propagation::DiffuseScattering coarse(city.city.mesh, scene, all_classes(rays));
    std::vector<std::vector<propagation::DiffusePath>> few(sky.size()), many(sky.size());
    Errors errors;
    for (std::size_t p = 0; p < city.positions.size(); p += 40) {
      for (std::size_t i = 0; i < sky.size(); ++i)
        hidden[i] = scene.occluded({city.positions[p], sky[i]}, 1e-3);
      coarse.trace(city.positions[p], sky, wanted, few);
      fine.trace(city.positions[p], sky, wanted, many);
      for (std::size_t i = 0; i < sky.size(); ++i)
        if (hidden[i]) errors.add(few[i], many[i]);
    }
    found.push_back(errors.quantiles(rays));
    ASSERT_GT(found.back().count, 200);
  }
  EXPECT_LT(found[1].db_p50, 0.6);
  EXPECT_LT(found[1].db_p90, 2);
  EXPECT_LT(found[1].m_p50, 10);
  EXPECT_LT(found[1].m_p90, 40);
  EXPECT_LE(found[1].missed, found[1].count / 20);
  EXPECT_LT(found[2].db_p90, 0.8);
  EXPECT_LT(found[2].m_p90, 16);
}

TEST(DiffuseScattering, ThreadsAgree) {
  const city::City city = city::synthetic_city({});
  RayScene scene(city.mesh);
  Mesh bus;
  canyon::test::append_box(bus, "bus", Surface::Vehicle, Material::Metal, {-6, -1.3, 0}, {6, 1.3, 3.2});
  scene.set_pose(scene.add_instance(bus), Eigen::Isometry3d(Eigen::Translation3d(20, 4, 0)));
  scene.commit();
  const propagation::DiffuseScattering scattering(city.mesh, scene);
  const std::vector<Vector3d> sky = bench::spread_sky(50);
  const auto every = std::make_unique<bool[]>(sky.size());
  std::fill_n(every.get(), sky.size(), true);
  std::array<std::vector<std::vector<propagation::DiffusePath>>, 3> results;
  std::vector<std::thread> threads;
  for (auto& result : results) {
    threads.emplace_back([&] {
      result.resize(sky.size());
      for (const double x : {-30.0, 10.0, 20.0})
        scattering.trace({x, 0.3, 2}, sky, {every.get(), sky.size()}, result);
    });
  }
  for (std::thread& thread : threads) thread.join();
  int bus_count = 0;
  for (std::size_t i = 0; i < sky.size(); ++i) {
    for (std::size_t t = 1; t < results.size(); ++t) {
      ASSERT_EQ(results[t][i].size(), results[0][i].size());
      for (std::size_t k = 0; k < results[0][i].size(); ++k) {
        EXPECT_EQ(results[t][i][k].power, results[0][i][k].power);
        EXPECT_EQ(results[t][i][k].excess_m, results[0][i][k].excess_m);
      }
    }
    for (const propagation::DiffusePath& path : results[0][i]) bus_count += path.instance != 0 ? 1 : 0;
  }
  EXPECT_GT(bus_count, 0);
}

TEST(DiffuseScattering, RefusesWhatIsNoDirection) {
  const World world({}, {});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)world.trace({0, 0, 0}, {0, 0, nan}), InputError);
  EXPECT_THROW((void)world.trace({0, 0, 0}, {0, 0, 1.01}), InputError);
  EXPECT_NO_THROW((void)world.trace({0, 0, 0}, {0, 0, 1}));
}

/// Ratio of powers with and without strengths [dB], class by class, of antennas along a street.
std::vector<double> strengths_db(const propagation::DiffuseOptions& options, std::uint64_t seed,
                                 double step_m) {
  Mesh mesh;
  canyon::test::append_box(mesh, "north", Surface::Building, Material::Concrete, {-3000, 10, 0},
                           {3000, 25, 30});
  canyon::test::append_box(mesh, "south", Surface::Building, Material::Concrete, {-3000, -25, 0},
                           {3000, -10, 30});
  const RayScene scene(mesh);
  const propagation::DiffuseScattering with(mesh, scene, options, seed);
  const propagation::DiffuseScattering without(mesh, scene, without_strengths(), seed);
  const std::vector<Vector3d> sky{direction(170, 30), direction(80, 40), direction(350, 50)};
  const std::array<bool, 3> wanted{true, true, true};
  std::vector<std::vector<propagation::DiffusePath>> a(3), b(3);
  std::vector<double> result;
  for (int i = 0; i < 400; ++i) {
    const Vector3d antenna(-2000 + step_m * i, 1, 2);
    with.trace(antenna, sky, wanted, a);
    without.trace(antenna, sky, wanted, b);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(a[k].size(), b[k].size());
      for (std::size_t j = 0; j < std::min(a[k].size(), b[k].size()); ++j) {
        EXPECT_EQ(a[k][j].excess_m, b[k][j].excess_m);
        result.push_back(10 * std::log10(a[k][j].power / b[k][j].power));
      }
    }
  }
  return result;
}

TEST(DiffuseStrengths, AreLogNormalAndOfTheSeed) {
  const propagation::DiffuseOptions options;
  std::vector<double> db = strengths_db(options, 1, 10);
  ASSERT_GT(db.size(), 2000U);
  EXPECT_EQ(db, strengths_db(options, 1, 10));
  EXPECT_NE(db, strengths_db(options, 2, 10));
  std::sort(db.begin(), db.end());
  const auto quantile = [&](double p) {
    return db[static_cast<std::size_t>(p * static_cast<double>(db.size()))];
  };
  // 1200 pieces or more: 0.3 dB of the mean, three times that.
  EXPECT_NEAR(quantile(0.5), options.strength_median_db, 1);
  EXPECT_NEAR(quantile(0.1), options.strength_median_db - 1.2816 * options.strength_sigma_db, 1.5);
  EXPECT_NEAR(quantile(0.9), options.strength_median_db + 1.2816 * options.strength_sigma_db, 1.5);
}

TEST(DiffuseStrengths, ChangeWithThePieceOfTheFacade) {
  // Along 40 m classes keep their number while their points move over pieces of 8 m.
  const auto spread = [](double step_m) {
    std::vector<double> db = strengths_db({}, 1, step_m);
    for (double& each : db) each = std::round(1e6 * each);
    std::sort(db.begin(), db.end());
    return std::unique(db.begin(), db.end()) - db.begin();
  };
  const auto at_rest = spread(0);
  EXPECT_LE(at_rest, 18) << "six classes of three satellites";
  EXPECT_GT(spread(0.1), 1.3 * static_cast<double>(at_rest));
}

TEST(DiffuseOptions, BoundsAreNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refuses = [](const char* field, const auto& set) {
    propagation::DiffuseOptions options;
    set(options);
    try {
      options.validate();
      ADD_FAILURE() << field << " is accepted";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(std::string("diffuse.") + field + " is "));
    }
    EXPECT_THROW(propagation::DiffuseScattering({}, RayScene(Mesh{}), options), InputError);
  };
  for (const double value : {-0.01, 1.01, nan})
    refuses("scattering_coefficient", [=](auto& o) { o.scattering_coefficient = value; });
  for (const double value : {0.0, 100'001.0, nan})
    refuses("max_range_m", [=](auto& o) { o.max_range_m = value; });
  for (const int value : {0, 9}) refuses("bounces", [=](auto& o) { o.bounces = value; });
  EXPECT_NO_THROW(propagation::DiffuseOptions().validate());
}

/// The fraction of power that a material reflects at L1, for uniform incidence from a half space.
double reflectance(Material material, double thickness_m) {
  constexpr double kL1 = 1575.42e6;
  const std::complex<double> eta = complex_permittivity(radio_material(material), kL1);
  double sum = 0;
  constexpr int kSteps = 2000;
  for (int k = 0; k < kSteps; ++k) {
    const double theta = (k + 0.5) / kSteps * kPi / 2;
    const LinearReflection r =
        thickness_m > 0 ? slab(eta, theta, thickness_m, wavelength_m(kL1)) : reflect_half_space(eta, theta);
    sum += (std::norm(r.perpendicular) + std::norm(r.parallel)) / 2 * std::sin(2 * theta) * kPi / 2 / kSteps;
  }
  return sum;
}

TEST(DiffuseOptions, ReflectanceIsFresnels) {
  for (const Material material :
       {Material::Unknown, Material::Concrete, Material::Brick, Material::Stone, Material::Glass,
        Material::Metal, Material::Wood, Material::Plaster, Material::Ground}) {
    EXPECT_NEAR(propagation::reflectance(material),
                reflectance(material, radio_material(material).default_thickness_m), 0.006)
        << static_cast<int>(material);
  }
  EXPECT_EQ(propagation::reflectance(Material::Foliage), 0);
}

/// Random walk backwards from the antenna between two facing walls of a street: scattered waves continue by
/// Lambert's law, and stay scattered.
struct Walk {
  double width, height, length, reflectance, scattered;
  std::mt19937_64 random{7};

  double uniform() { return std::uniform_real_distribution<double>()(random); }
  /// The range to one of the walls y = +-width / 2 within the street; 0: none.
  [[nodiscard]] double range_m(const Vector3d& from, const Vector3d& towards) const {
    if (towards.y() == 0) return 0;
    const double range = ((towards.y() > 0 ? width : -width) / 2 - from.y()) / towards.y();
    const Vector3d point = from + range * towards;
    const bool on = range > 1e-9 && std::abs(point.x()) < length / 2 && point.z() > 0 && point.z() < height;
    return on ? range : 0;
  }
  /// Power over the line of sight's, and its mean detour [m].
  std::pair<double, double> to(const Vector3d& antenna, const Vector3d& satellite, int bounces) {
    constexpr int kWalks = 400'000;
    double power = 0, power_excess = 0;
    for (int k = 0; k < kWalks; ++k) {
      const double z = 2 * uniform() - 1, rotation = 2 * kPi * uniform(), across = std::sqrt(1 - z * z);
      Vector3d towards(across * std::cos(rotation), across * std::sin(rotation), z), at = antenna;
      double carried = 4 * kPi / kWalks, travelled_m = 0;
      bool was_scattered = false;
      for (int bounce = 0; bounce < bounces; ++bounce) {
        const double range = range_m(at, towards);
        if (range == 0) break;
        at += range * towards;
        travelled_m += range;
        const double side = at.y() > 0 ? -1 : 1;  // of the normal
        carried *= reflectance;
        const double cos_lit = side * satellite.y();
        if (cos_lit > 0 && range_m(at, satellite) == 0) {
          const double here = carried * (was_scattered ? 1 : scattered) * cos_lit / kPi;
          power += here;
          power_excess += here * (travelled_m - satellite.dot(at - antenna));
        }
        if (uniform() < scattered) {
          was_scattered = true;
          const double u = uniform(), v = 2 * kPi * uniform();
          towards = {std::sqrt(u) * std::cos(v), side * std::sqrt(1 - u), std::sqrt(u) * std::sin(v)};
        } else {
          towards.y() = -towards.y();
        }
      }
    }
    return {power, power_excess / power};
  }
};

TEST(DiffuseScattering, SeveralFacadesGiveWhatARandomWalkGives) {
  Walk walk{20, 30, 160, 0.8, 0.25};
  Mesh mesh;
  append_sheet(mesh, {-80, 10, 0}, {160, 0, 0}, {0, 0, 30});
  append_sheet(mesh, {80, -10, 0}, {-160, 0, 0}, {0, 0, 30});
  propagation::DiffuseOptions options = everything();
  options.wall_reflectance = walk.reflectance;
  options.scattering_coefficient = std::sqrt(walk.scattered);
  const Vector3d antenna(5, 2, 1.5);
  std::array<double, 5> by_bounces{};
  for (const int bounces : {1, 2, 4}) {
    options.bounces = bounces;
    const World world(mesh, options);
    // The shadow's edge on a long wall is accurate to half a cell (FacadeLight): over many satellites that
    // averages out.
    double power_ratio = 0, excess_ratio = 0, total = 0;
    int satellites = 0;
    for (double elevation = 45; elevation < 66; elevation += 1.5) {
      for (const double azimuth : {170.0, 20.0}) {
        const Vector3d satellite = direction(azimuth, elevation);
        const auto [power, excess] = walk.to(antenna, satellite, bounces);
        const std::vector<propagation::DiffusePath> paths = world.trace(antenna, satellite);
        EXPECT_NEAR(total_power(paths) / power, 1, 0.3);
        EXPECT_NEAR(mean_excess(paths) / excess, 1, 0.08);
        power_ratio += total_power(paths) / power;
        excess_ratio += mean_excess(paths) / excess;
        total += total_power(paths);
        ++satellites;
        for (const propagation::DiffusePath& path : paths) {
          EXPECT_NEAR(std::abs(path.point.y()), 10, 1e-3);
          EXPECT_NEAR((path.point - antenna).normalized().dot(path.arrival), 1, 1e-9);
        }
      }
    }
    std::printf("%d: power %.4f, excess %.4f\n", bounces, power_ratio / satellites,
                excess_ratio / satellites);
    EXPECT_NEAR(power_ratio / satellites, 1, 0.04);
    EXPECT_NEAR(excess_ratio / satellites, 1, 0.04);
    by_bounces[static_cast<std::size_t>(bounces)] = total;
  }
  EXPECT_GT(by_bounces[4], 1.3 * by_bounces[1]);
}

}  // namespace
}  // namespace canyon::signal
