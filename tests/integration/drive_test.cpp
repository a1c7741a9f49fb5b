// The recorded drive through Tsim Sha Tsui, the same bytes on any number of threads, and the run's outputs.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <numeric>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/loaded_city.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon {
namespace {

/// The scenario of examples/urbannav_tst.yaml, without pictures.
std::string drive_yaml(const std::string& model, const std::string& systems, int mask_deg) {
  return "city:\n  mesh: hongkong/buildings.dae\n"
         "  origin: {latitude_deg: 22.298251, longitude_deg: 114.178761, height_m: 0}\n"
         "  offset: {east_m: 0, north_m: 8, up_m: 0}\n"
         "sky:\n  navigation: [urbannav-tst-20190428/hksc1180.19n, urbannav-tst-20190428/hksc1180.19b]\n"
         "  systems: [" +
         systems +
         "]\n"
         "trajectory:\n  file: urbannav-tst-20190428/groundTruth_TST.csv\n  format: urbannav\n"
         "  height_above_terrain_m: 2.0\n"
         "receivers:\n  - name: rover\n    profile: paper\n    elevation_mask_deg: " +
         std::to_string(mask_deg) + "\npropagation: {model: " + model +
         "}\nnoise: {enabled: true}\nseed: 1\noutputs: {pictures: false}\n";
}

/// Mean elevation [deg] of the skyline around a point, over 72 azimuths in steps of one degree of elevation.
double skyline_deg(const simulation::Simulation& simulation, const Eigen::Vector3d& antenna) {
  double sum = 0;
  for (int azimuth = 0; azimuth < 360; azimuth += 5) {
    int elevation = 0;
    while (elevation < 90 &&
           simulation.environment().scene().occluded(
               {antenna, geodesy::enu_from_azimuth_elevation(geodesy::radians(azimuth),
                                                             geodesy::radians(elevation + 0.5))})) {
      ++elevation;
    }
    sum += elevation;
  }
  return sum / 72;
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Runs the drive and returns the skyline where fixes are lost or bad, and at the better half of the fixes.
void expect_trouble_near_tall_buildings(const std::string& model, const std::string& systems, int mask_deg,
                                        std::size_t least_lost) {
  CANYON_SHARED_DATA(mesh, "hongkong/buildings.dae");
  const simulation::Simulation simulation =
      test::prepare(drive_yaml(model, systems, mask_deg), mesh.parent_path().parent_path());
  const test::TemporaryFolder folder;
  const auto epochs = test::run_and_write(simulation, folder.path());
  ASSERT_EQ(epochs.size(), 485U);
  EXPECT_EQ(epochs.front().observed.time, geodesy::GpsTime::from_week(2051, 46701));
  EXPECT_EQ(epochs.back().observed.time, geodesy::GpsTime::from_week(2051, 47185));

  std::vector<double> errors;
  for (const auto& epoch : epochs) {
    if (epoch.observed.fix.solved()) errors.push_back(epoch.error_enu_m.head<2>().norm());
  }
  ASSERT_GT(errors.size(), 200U);
  std::sort(errors.begin(), errors.end());
  const double median = errors[errors.size() / 2];
  const double large = errors[errors.size() * 9 / 10];
  std::vector<double> good;
  std::vector<double> bad;
  std::vector<double> lost;
  for (const auto& epoch : epochs) {
    const double skyline =
        skyline_deg(simulation, simulation.environment().city().frame.local_from_ecef(epoch.truth_ecef));
    if (!epoch.observed.fix.solved()) {
      lost.push_back(skyline);
    } else if (const double error = epoch.error_enu_m.head<2>().norm(); error <= median) {
      good.push_back(skyline);
    } else if (error >= large) {
      bad.push_back(skyline);
    }
  }
  std::cout << model << ", " << systems << ", mask " << mask_deg << " deg: " << errors.size() << " fixes, "
            << lost.size() << " epochs without; horizontal error median " << median << " m, 90 % " << large
            << " m; mean skyline " << mean(good) << " deg at the better half of the fixes, " << mean(bad)
            << " deg at the worst tenth, " << mean(lost) << " deg where the fix is lost\n";
  EXPECT_GT(mean(bad), mean(good));
  EXPECT_GE(lost.size(), least_lost);
  if (!lost.empty()) {
    EXPECT_GT(mean(lost), mean(good));
  }
}

TEST(Drive, SpecularTroubleFallsBesideTallBuildings) {
  expect_trouble_near_tall_buildings("specular", "GPS, BeiDou", 10, 0);
}
TEST(Drive, MirrorTroubleFallsBesideTallBuildings) {
  expect_trouble_near_tall_buildings("mirror", "GPS, BeiDou", 10, 0);
}
TEST(Drive, SpecularGpsAloneLosesItsFixBesideTallBuildings) {
  expect_trouble_near_tall_buildings("specular", "GPS", 15, 50);
}
TEST(Drive, MirrorGpsAloneLosesItsFixBesideTallBuildings) {
  expect_trouble_near_tall_buildings("mirror", "GPS", 15, 20);
}

const char* const kSyntheticYaml =
    "city: {synthetic: {seed: 7}}\nsky: {nominal: true}\nstart: 2026-03-01T10:00:00Z\n"
    "trajectory: {waypoints: [{east_m: -150, north_m: 0, up_m: 2}, {east_m: 150, north_m: 0, up_m: 2}], "
    "speed_mps: 5}\n"
    "receivers: [{name: a, profile: paper}, {name: b, elevation_mask_deg: 5, lever_arm: {forward_m: 1, "
    "left_m: 0.5, up_m: 0.2}}]\n"
    "rate_hz: 5\nseed: 42\noutputs: {pictures: false}\n";

TEST(Drive, SameSeedGivesTheSameBytesOnOneAndTwoThreads) {
  const test::TemporaryFolder one;
  const test::TemporaryFolder two;
  const simulation::Simulation simulation = test::prepare(kSyntheticYaml, one.path());
  (void)test::run_and_write(simulation, one.path(), 1);
  // Made again: nothing left by the first run may have an effect.
  (void)test::run_and_write(test::prepare(kSyntheticYaml, two.path()), two.path(), 2);
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(one.path())) {
    if (!entry.is_regular_file()) continue;
    ++files;
    const auto other = two.path() / std::filesystem::relative(entry.path(), one.path());
    const std::string bytes = test::read_bytes(entry.path());
    EXPECT_GT(bytes.size(), 100U) << entry.path();
    EXPECT_TRUE(bytes == test::read_bytes(other)) << entry.path() << " differs";
  }
  // Two receivers with epochs, satellites, NMEA, RINEX, KML and GeoJSON each, and one navigation file.
  EXPECT_EQ(files, 13U);
}

TEST(Drive, AnotherSeedGivesOtherNoise) {
  const test::TemporaryFolder folder;
  simulation::Scenario scenario = simulation::parse_scenario(kSyntheticYaml, folder.path() / "a.yaml");
  scenario.duration_s = 2;
  std::vector<double> noise;
  for (const std::uint64_t seed : {1U, 2U}) {
    scenario.seed = seed;
    const simulation::Simulation simulation(scenario, test::loaded_city(scenario.city));
    test::Recorder recorder;
    simulation.run({&recorder});
    for (const auto& satellite : recorder.epochs.front().observed.satellites) {
      if (satellite.measurement) {
        noise.push_back(satellite.noise_m);
        break;
      }
    }
  }
  ASSERT_EQ(noise.size(), 2U);
  EXPECT_NE(noise[0], noise[1]);
}

}  // namespace
}  // namespace canyon
