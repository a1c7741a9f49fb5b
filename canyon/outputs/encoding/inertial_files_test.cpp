#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/city.hpp"
#include "canyon/outputs/encoding/sinks.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::encoding {
namespace {

/// Lines of numbers after `header_lines`.
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
  void run(const std::string& imu, const std::string& outputs,
           const std::string& receivers = "{name: rover, profile: ideal}, {name: other, profile: ideal}") {
    simulation::Scenario scenario = simulation::parse_scenario(
        "city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17, height_m: 5}}\n"
        "start: 2026-06-01T06:00:00Z\nduration_s: 3\nrate_hz: 2\n"
        "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 900, north_m: 0, up_m: 2}], "
        "acceleration_mps2: 5, speed_mps: 30}\n"
        "receivers: [" +
            receivers + "]\nsensors: {imu: {rate_hz: 100, " + imu + "}}\noutputs: " + outputs + "\n",
        "s.yaml");
    city::City city;
    city.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(22.3, 114.17, 5));
    const simulation::Simulation simulation(scenario, city);
    std::vector<simulation::EpochSink*> sinks;
    const auto files = make_file_sinks(simulation, folder_.path());
    sinks.reserve(files.size());
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
  EXPECT_NEAR(imu[0][1] - std::floor(imu[0][1]), 0.01, 1e-9);
  EXPECT_NEAR(imu[299][1] - imu[0][1], 2.99, 1e-9);
  // Full acceleration from 2.2 s on, to the east, with the nose there: the mean of a constant equals it.
  EXPECT_NEAR(imu[280][2], 5, 0.01);
  EXPECT_NEAR(motion[280][11], 5, 0.01);
  EXPECT_NEAR(imu[280][4], 9.788, 0.003);
  EXPECT_NEAR(motion[280][10], 90, 1e-3);
  // 1 m north of the vehicle's point: 1 / 110,743 of a degree at this latitude.
  EXPECT_NEAR((motion[280][2] - 22.3) * 110'743, 1, 1e-3);
  EXPECT_NEAR(motion[280][4], 7, 1e-3);
  // Velocities are derivatives of positions; the radius of the parallel's prime vertical, 7 m up.
  const double metres =
      geodesy::radians(motion[290][3] - motion[280][3]) * 6'381'221 * std::cos(geodesy::radians(22.3));
  EXPECT_NEAR(metres / 0.1, (motion[290][5] + motion[280][5]) / 2, 1e-3);
}

// The files of the vehicle are there in any case.
TEST_F(InertialFilesTest, AReceiverWithAFixedPositionHasNoSensors) {
  const std::string base = "{name: base, profile: ideal, fixed: {east_m: 9, north_m: 9, up_m: 9}}";
  run("profile: ideal", "[imu, mcap, highres_imu]", base + ", {name: rover, profile: ideal}");
  EXPECT_EQ(rows("imu.csv", 1).size(), 300U);
  EXPECT_TRUE(exists("rover/highres_imu.mavlink"));
  EXPECT_FALSE(exists("base/highres_imu.mavlink"));
  const auto has_samples = [&](const char* file) {
    return test::read_bytes(folder_.path() / file).find("/imu/data_raw") != std::string::npos;
  };
  EXPECT_TRUE(has_samples("rover/drive.mcap"));
  EXPECT_FALSE(has_samples("base/drive.mcap"));
  EXPECT_THAT(test::refusal([&] { run("profile: ideal", "[highres_imu]", base); }),
              ::testing::HasSubstr("and a receiver without a fixed position"));
}

TEST_F(InertialFilesTest, LeaveLostSamplesOut) {
  run("profile: ideal, lost: 0.5, axes: frd", "[imu]");
  EXPECT_LT(rows("imu.csv", 1).size(), 200U);
  EXPECT_EQ(rows("motion.csv", 1).size(), 300U);
  EXPECT_NEAR(rows("imu.csv", 1)[0][4], -9.78, 0.1);
}

// The wheels of the drive: the true speed is the mean speed of the motion, and ticks count the distance.
TEST_F(InertialFilesTest, HaveTheWheels) {
  run("profile: ideal}, wheels: {rate_hz: 20, tick_m: 0.01, scale: 0, slip: 0", "[imu, wheels]");
  const auto wheels = rows("wheels.csv", 1), motion = rows("motion.csv", 1);
  ASSERT_EQ(wheels.size(), 60U);
  ASSERT_EQ(wheels[0].size(), 8U);
  double travelled_m = 0;
  for (std::size_t k = 1; k < 60; ++k) {
    EXPECT_NEAR(wheels[k][1], motion[5 * k + 4][1], 1e-9);
    const double mean = (motion[5 * k - 1][5] + motion[5 * k + 4][5]) / 2;  // trapezoidal
    EXPECT_NEAR(wheels[k][6], mean, 2e-3);
    EXPECT_NEAR(wheels[k][2], wheels[k][6], 0.01 / 0.05 + 1e-9);
    travelled_m += wheels[k][6] * 0.05;
  }
  EXPECT_NEAR(wheels[59][4] * 0.01, travelled_m, 0.011);
  EXPECT_GT(travelled_m, 3);
}

TEST_F(InertialFilesTest, AreNotThereWithoutASensor) {
  run("profile: ideal", "[epochs_csv]");
  EXPECT_FALSE(exists("imu.csv"));
}

// Without errors: the pressure of the height above mean sea level, at the time of each sample.
TEST_F(InertialFilesTest, PressuresFollowTheHeight) {
  run("profile: ideal}, barometer: {profile: ideal, rate_hz: 10", "[barometer]");
  const auto samples = rows("barometer.csv", 1);
  ASSERT_EQ(samples.size(), 30U);
  ASSERT_EQ(samples[0].size(), 8U);
  EXPECT_NEAR(samples[29][1] - samples[0][1], 2.9, 1e-9);
  for (const auto& sample : samples) {
    EXPECT_NEAR(sample[7], 7, 0.01);  // 2 m above the origin's 5 m
    EXPECT_EQ(sample[2], sample[6]);
    EXPECT_NEAR(sample[3], sample[7], 1e-6);
  }
  EXPECT_FALSE(exists("imu.csv"));
}

// The weather's change in 2 s, with that of a path which rises by 0.7 mm.
TEST_F(InertialFilesTest, PressuresFollowTheWeather) {
  run("profile: ideal}, barometer: {profile: ideal, rate_hz: 10, pressure_change_pa_h: 2000", "[barometer]");
  const auto samples = rows("barometer.csv", 1);
  ASSERT_EQ(samples.size(), 30U);
  EXPECT_NEAR(samples[29][6] - samples[9][6], 2 * 2000 / 3600.0, 0.02);
  EXPECT_EQ(samples[29][2], samples[29][6]);
}

// NumPy reads the file if it is installed; the values also equal those of the text files.
TEST_F(InertialFilesTest, ArraysAreTheSameNumbers) {
  run("profile: consumer, lost: 0.1}, wheels: {tick_m: 0}, barometer: {}, magnetometer: {",
      "[imu, sensors_npz]");
  const std::string npz = (folder_.path() / "sensors.npz").string();
  if (std::system("python3 -c 'import numpy' 2>/dev/null") != 0) GTEST_SKIP() << "NumPy is not installed";
  const std::string check =
      "import numpy as n, zipfile, csv\n"
      "assert zipfile.ZipFile('" +
      npz +
      "').testzip() is None\n"
      "f = n.load('" +
      npz +
      "')\n"
      "rows = n.array([[float(x) for x in r] for r in list(csv.reader(open('" +
      (folder_.path() / "imu.csv").string() +
      "')))[1:]])\n"
      "seen = ~n.isnan(f['imu_stated_s'])\n"
      "assert f['imu_time_s'].shape == (300,) and 200 < seen.sum() < 299\n"
      "assert abs(f['imu_specific_force'][seen] - rows[:, 2:5]).max() < 0.51e-12\n"
      "assert abs(f['imu_angular_rate'][seen] - rows[:, 5:8]).max() < 0.51e-14\n"
      "assert abs(f['imu_temperature'][seen] - rows[:, 8]).max() < 1e-6 and abs(rows[-1, 8] - 298.15) < "
      "1e-9\n"
      "assert abs(f['begin'][1] + f['imu_stated_s'][seen] - rows[:, 1]).max() < 1e-6\n"
      "assert f['wheels_speed'].shape == (30, 2) and n.isnan(f['wheels_ticks']).all()\n"
      "assert f['barometer_pressure'].shape == (75,) and f['magnetometer_field'].shape == (150, 3)\n"
      "assert 40 < n.linalg.norm(f['magnetometer_true_field'][0]) < 50\n";
  std::ofstream(folder_.path() / "check.py") << check;
  EXPECT_EQ(std::system(("python3 " + (folder_.path() / "check.py").string()).c_str()), 0);
}

// The field in Hong Kong by NOAA's calculator: 45 uT, 33 deg below the horizon, 3 deg west of north. The
// car's nose is to the east.
TEST_F(InertialFilesTest, FieldsAreTheEarths) {
  run("profile: ideal}, magnetometer: {profile: ideal, rate_hz: 10, axes: frd", "[magnetometer]");
  const auto samples = rows("magnetometer.csv", 1);
  ASSERT_EQ(samples.size(), 30U);
  ASSERT_EQ(samples[29].size(), 8U);
  const double east = samples[29][2], south = samples[29][3], down = samples[29][4];
  EXPECT_NEAR(std::hypot(east, south, down), 45, 1);
  EXPECT_NEAR(geodesy::degrees(std::atan2(east, -south)), -3.3, 0.5);
  EXPECT_NEAR(geodesy::degrees(std::atan2(down, std::hypot(east, south))), 33, 1);
  for (std::size_t i = 2; i < 5; ++i) EXPECT_NEAR(samples[29][i], samples[29][i + 3], 1e-9);
}

}  // namespace
}  // namespace canyon::encoding
