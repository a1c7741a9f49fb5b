// A city written to any of Canyon's formats and read back traces the same paths as the original.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <random>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/city_file.hpp"
#include "canyon/city/gazebo_export.hpp"
#include "canyon/city/gazebo_import.hpp"
#include "canyon/city/mesh_export.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/sky/orbit/sky.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon {
namespace {

constexpr int kSatellites = 24;
constexpr int kPositions = 100;

/// The arrivals at random points (by a seed) in a city.
std::vector<propagation::Arrival> arrivals(const city::City& city,
                                           const std::vector<Eigen::Vector3d>& points) {
  std::mt19937_64 random(42);
  std::uniform_real_distribution<double> fraction(0, 1);
  std::vector<double> azimuths;
  std::vector<double> elevations;
  for (int i = 0; i < kSatellites; ++i) {
    azimuths.push_back(2 * geodesy::kPi * fraction(random));
    elevations.push_back(geodesy::radians(5 + 80 * fraction(random)));
  }
  const auto sky = std::make_shared<orbit::FrozenSky>(city.frame.origin(), azimuths, elevations);
  const simulation::Environment environment(city, sky);
  propagation::PropagationOptions options;
  options.ground_reflection = true;
  const propagation::Propagator propagator = environment.make_propagator(options);
  std::vector<propagation::Arrival> result;
  for (const Eigen::Vector3d& point : points) {
    result.push_back(environment.arrival(geodesy::GpsTime::from_week(2100, 0), point, propagator));
  }
  return result;
}

/// Free points 2 m above the lowest ground.
std::vector<Eigen::Vector3d> points_in(const city::City& city) {
  const city::Box bounds = city.bounds();
  const raytrace::RayScene scene(city.mesh);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> fraction(0.1, 0.9);
  std::vector<Eigen::Vector3d> points;
  for (int tries = 0; tries < 100 * kPositions && points.size() < kPositions; ++tries) {
    Eigen::Vector3d point = bounds.min;
    for (int axis = 0; axis < 2; ++axis) {
      point[axis] += fraction(random) * (bounds.max - bounds.min)[axis];
    }
    point.z() += 2;
    if (scene.containment(point) == raytrace::Containment::Free) points.push_back(point);
  }
  return points;
}

struct Format {
  std::string name;
  std::function<void(const std::filesystem::path&, const city::City&)> write;
  std::function<city::City(const std::filesystem::path&, const geodesy::Geodetic&)> read;
  /// Tolerance of corners read back; 0: exact.
  double corner_m;
};

std::vector<Format> formats() {
  const auto write_mesh = [](const auto& path, const auto& city) { city::write_mesh(path, city); };
  const auto read_mesh = [](const auto& path, const auto& origin) {
    city::MeshImportOptions options;
    options.origin = origin;
    return city::read_mesh_city(path, options);
  };
  return {{"c.canyon", [](const auto& path, const auto& city) { city::write_city_file(path, city); },
           [](const auto& path, const auto&) { return city::read_city_file(path); }, 0},
          {"c.glb", write_mesh, read_mesh, 1e-4},
          {"c.obj", write_mesh, read_mesh, 1e-4},
          {"c.dae", write_mesh, read_mesh, 1e-4},
          {"c.world",
           [](const auto& path, const auto& city) {
             city::GazeboOptions options;
             options.triangles_per_mesh = 3000;
             city::write_gazebo_world(path, city, options);
           },
           [](const auto& path, const auto&) { return city::read_gazebo_world(path); }, 1e-4}};
}

void expect_same_paths_through_all_formats(const city::City& city) {
  const std::vector<Eigen::Vector3d> points = points_in(city);
  ASSERT_GT(points.size(), 20U);
  const auto expected = arrivals(city, points);
  for (const Format& format : formats()) {
    SCOPED_TRACE(format.name);
    const canyon::test::TemporaryFolder folder;
    format.write(folder / format.name, city);
    const auto actual = arrivals(format.read(folder / format.name, city.frame.origin()), points);
    ASSERT_EQ(actual.size(), expected.size());
    std::size_t views = 0;
    std::size_t paths = 0;
    std::size_t differing = 0;
    double worst_m = 0;
    for (std::size_t p = 0; p < expected.size(); ++p) {
      EXPECT_EQ(actual[p].containment, expected[p].containment);
      ASSERT_EQ(actual[p].views.size(), expected[p].views.size());
      for (std::size_t s = 0; s < expected[p].views.size(); ++s) {
        const auto& a = actual[p].views[s].paths;
        const auto& e = expected[p].views[s].paths;
        ++views;
        paths += e.paths.size();
        if (a.visibility != e.visibility || a.paths.size() != e.paths.size()) {
          ++differing;
          continue;
        }
        for (std::size_t k = 0; k < e.paths.size(); ++k) {
          worst_m = std::max(worst_m, std::abs(a.paths[k].excess_m - e.paths[k].excess_m));
        }
      }
    }
    std::cout << format.name << ": " << views << " satellites in view, " << paths << " paths, " << differing
              << " differ, excess paths within " << worst_m << " m\n";
    EXPECT_GT(paths, views / 4);
    EXPECT_EQ(differing, 0U);
    // A facet whose corners move by d tilts by d over its size and moves the image by that over the range.
    EXPECT_LE(worst_m, format.corner_m * 10);
  }
}

TEST(CityRoundTrip, SyntheticDowntownTracesTheSamePaths) {
  expect_same_paths_through_all_formats(city::synthetic_city({}));
}

TEST(CityRoundTrip, HongKongTracesTheSamePaths) {
  CANYON_SHARED_DATA(dae, "hongkong/buildings.dae");
  city::MeshImportOptions options;
  options.origin = geodesy::Geodetic::from_degrees(22.298251, 114.178761, 0);
  options.offset_m = {0, 8, 0};
  expect_same_paths_through_all_formats(city::read_mesh_city(dae, options));
}

}  // namespace
}  // namespace canyon
