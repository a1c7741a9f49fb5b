#include "canyon/output/inertial_files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "canyon/base/text.hpp"
#include "canyon/city/city.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/output/sinks.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::output {
namespace {

/// Lines of numbers behind `header_lines`.
std::vector<std::vector<double>> numbers_of(const std::filesystem::path& path, std::size_t header_lines) {
  std::vector<std::vector<double>> rows;
  const std::string bytes = test::read_bytes(path);
  std::size_t number = 0;
  for (const std::string_view line : split(bytes, '\n')) {
    if (number++ < header_lines || line.empty()) continue;
    std::vector<double>& row = rows.emplace_back();
    for (const std::string_view cell : split(line, line.find(',') != std::string_view::npos ? ',' : ' '))
      row.push_back(std::strtod(std::string(cell).c_str(), nullptr));
  }
  return rows;
}

class InertialFilesTest : public ::testing::Test {
 protected:
  /// Runs 3 s of a drive to the east, 5 m/s^2, with this section `imu` and these outputs.
  void run(const std::string& imu, const std::string& outputs) {
    simulation::Scenario scenario = simulation::parse_scenario(
        "city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17, height_m: 5}}\n"
        "start: 2026-06-01T06:00:00Z\nduration_s: 3\nrate_hz: 2\n"
        "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 900, north_m: 0, up_m: 2}], "
        "acceleration_mps2: 5, speed_mps: 30}\n"
        "receivers: [{name: rover, profile: ideal}, {name: other, profile: ideal}]\n"
        "sensors: {imu: {rate_hz: 100, " +
            imu + "}}\noutputs: " + outputs + "\n",
        "s.yaml");
    city::City city;
    city.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(22.3, 114.17, 5));
    const simulation::Simulation simulation(scenario, city);
    std::vector<simulation::EpochSink*> sinks;
    const auto files = make_file_sinks(simulation, folder_.path());
    for (const auto& file : files) sinks.push_back(file.get());
    (void)simulation.run(sinks);
  }
  [[nodiscard]] std::vector<std::vector<double>> rows(const char* name, std::size_t header_lines = 0) const {
    return numbers_of(folder_.path() / name, header_lines);
  }
  [[nodiscard]] bool exists(const char* name) const { return std::filesystem::exists(folder_.path() / name); }

  test::TemporaryFolder folder_;
};

TEST_F(InertialFilesTest, HaveEachSampleUntilTheLastEpoch) {
  run("profile: ideal, position: {left_m: 1}", "[imu]");
  const auto imu = rows("imu.csv", 1), motion = rows("motion.csv", 1);
  ASSERT_EQ(imu.size(), 300U);
  ASSERT_EQ(motion.size(), 300U);
  EXPECT_FALSE(exists("kf_gins_imu.txt"));
  EXPECT_NEAR(imu[0][1] - std::floor(imu[0][1]), 0.01, 1e-9);
  EXPECT_NEAR(imu[299][1] - imu[0][1], 2.99, 1e-9);
  // Full acceleration from 2.2 s on, to the east, with the nose there: the means of a constant are equal to
  // it.
  EXPECT_NEAR(imu[280][2], 5, 0.01);
  EXPECT_NEAR(motion[280][11], 5, 0.01);
  EXPECT_NEAR(imu[280][4], 9.788, 0.003);
  EXPECT_NEAR(motion[280][10], 90, 1e-3);
  // 1 m north of the vehicle's point: 1 / 110,743 of a degree at this latitude.
  EXPECT_NEAR((motion[280][2] - 22.3) * 110'743, 1, 1e-3);
  EXPECT_NEAR(motion[280][4], 7, 1e-3);
  // Velocities are derivatives of places; the radius of the parallel's prime vertical, 7 m up.
  const double metres =
      geodesy::radians(motion[290][3] - motion[280][3]) * 6'381'221 * std::cos(geodesy::radians(22.3));
  EXPECT_NEAR(metres / 0.1, (motion[290][5] + motion[280][5]) / 2, 1e-3);
}

TEST_F(InertialFilesTest, HaveTheLayoutOfKfGins) {
  run("profile: ideal", "[imu, kf_gins]");
  const auto imu = rows("imu.csv", 1), increments = rows("kf_gins_imu.txt"),
             truth = rows("kf_gins_truth.nav"), motion = rows("motion.csv", 1),
             fixes = rows("kf_gins_gnss.txt");
  ASSERT_EQ(increments.size(), imu.size());
  ASSERT_EQ(truth.size(), imu.size());
  ASSERT_EQ(increments[7].size(), 7U);
  // Increments over 10 ms, forward, right, down.
  EXPECT_NEAR(increments[250][4], 0.01 * imu[250][2], 1e-15);
  EXPECT_NEAR(increments[250][6], -0.01 * imu[250][4], 1e-15);
  EXPECT_NEAR(increments[250][3], -0.01 * imu[250][7], 1e-15);
  EXPECT_NEAR(increments[250][1], 0.01 * imu[250][5], 1e-15);
  ASSERT_EQ(truth[7].size(), 11U);
  EXPECT_NEAR(truth[250][2], motion[250][2], 1e-12);
  EXPECT_NEAR(truth[250][6], motion[250][5], 1e-9);  // east
  EXPECT_NEAR(truth[250][10], motion[250][10], 1e-8);
  // Seven epochs of the first receiver alone, near the truth.
  ASSERT_EQ(fixes.size(), 7U);
  ASSERT_EQ(fixes[0].size(), 7U);
  EXPECT_NEAR(fixes[6][1], truth[299][2], 1e-5);
  EXPECT_GT(fixes[6][4], 0);
}

TEST_F(InertialFilesTest, LeaveLostSamplesOut) {
  run("profile: ideal, lost: 0.5, axes: frd", "[imu, kf_gins]");
  EXPECT_LT(rows("imu.csv", 1).size(), 200U);
  EXPECT_EQ(rows("imu.csv", 1).size(), rows("kf_gins_imu.txt").size());
  EXPECT_EQ(rows("motion.csv", 1).size(), 300U);
  EXPECT_NEAR(rows("kf_gins_imu.txt")[0][6], -0.0978, 0.001);
}

// The wheels of the drive: the true speed is the mean of that of the motion, and ticks count the way.
TEST_F(InertialFilesTest, HaveTheWheels) {
  run("profile: ideal}, wheels: {rate_hz: 20, tick_m: 0.01, scale: 0, slip: 0", "[imu, wheels]");
  const auto wheels = rows("wheels.csv", 1), motion = rows("motion.csv", 1);
  ASSERT_EQ(wheels.size(), 60U);
  ASSERT_EQ(wheels[0].size(), 8U);
  double way_m = 0;
  for (std::size_t k = 1; k < 60; ++k) {
    EXPECT_NEAR(wheels[k][1], motion[5 * k + 4][1], 1e-9);
    const double mean = (motion[5 * k - 1][5] + motion[5 * k + 4][5]) / 2;  // trapezoidal
    EXPECT_NEAR(wheels[k][6], mean, 2e-3);
    EXPECT_NEAR(wheels[k][2], wheels[k][6], 0.01 / 0.05 + 1e-9);
    way_m += wheels[k][6] * 0.05;
  }
  EXPECT_NEAR(wheels[59][4] * 0.01, way_m, 0.011);
  EXPECT_GT(way_m, 3);
}

TEST_F(InertialFilesTest, AreNotThereWithoutASensor) {
  run("profile: ideal", "[epochs_csv]");
  EXPECT_FALSE(exists("imu.csv"));
}

// Without errors: the pressure of the height above mean sea level, at the time of each sample.
TEST_F(InertialFilesTest, PressuresFollowTheHeight) {
  run("profile: ideal}, barometer: {rate_hz: 10, noise_pa: 0, turn_on_pa: 0, drift_pa: 0", "[barometer]");
  const auto samples = rows("barometer.csv", 1);
  ASSERT_EQ(samples.size(), 30U);
  ASSERT_EQ(samples[0].size(), 7U);
  EXPECT_NEAR(samples[29][1] - samples[0][1], 2.9, 1e-9);
  for (const auto& sample : samples) {
    EXPECT_NEAR(sample[6], 7, 0.01);  // 2 m above the origin's 5 m
    EXPECT_EQ(sample[2], sample[5]);
    EXPECT_NEAR(sample[3], sample[6], 1e-6);
  }
  EXPECT_FALSE(exists("imu.csv"));
}

}  // namespace
}  // namespace canyon::output
