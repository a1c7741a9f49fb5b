#include "canyon/simulation/inertial/sensors.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "canyon/base/input_error.hpp"

namespace canyon::inertial {
namespace {

BarometerOptions perfect_barometer() {
  BarometerOptions options;
  options.profile = BarometerProfile::Ideal;
  return options;
}

// U.S. Standard Atmosphere 1976, table I, by geometric height.
TEST(Air, IsTheStandardAtmosphere) {
  constexpr double kTable[][3]{{0, 101325, 288.150},     {1000, 89876, 281.651},   {5000, 54048, 255.676},
                               {10000, 26500, 223.252},  {11000, 22700, 216.774},  {15000, 12112, 216.650},
                               {20000, 5529.3, 216.650}, {30000, 1197.0, 226.509}, {40000, 287.14, 250.350}};
  for (const auto& [height_m, pressure_pa, temperature_k] : kTable) {
    const Air air = air_at(height_m);
    EXPECT_NEAR(air.pressure_pa / pressure_pa, 1, 2e-4) << height_m;
    EXPECT_NEAR(air.temperature_k, temperature_k, 2e-3) << height_m;
    EXPECT_NEAR(pressure_altitude_m(air.pressure_pa), height_m, 1e-6 * std::max(1.0, height_m));
  }
  EXPECT_NEAR(air_at(0).density_kgpm3(), 1.2250, 1e-4);
  EXPECT_NEAR(pressure_altitude_m(air_at(-400).pressure_pa), -400, 1e-6);
  EXPECT_EQ(air_at(60000).pressure_pa, air_at(47000).pressure_pa);
}

// A metre near the ground is 12 Pa, at 0 deg C 5 % more than at 15.
TEST(Air, FollowsTheDay) {
  const auto fall_pa = [](double celsius) {
    return air_at(0, 101325, 273.15 + celsius).pressure_pa - air_at(1, 101325, 273.15 + celsius).pressure_pa;
  };
  EXPECT_NEAR(fall_pa(15), 9.80665 * 1.2250, 0.01);
  EXPECT_NEAR(fall_pa(0) / fall_pa(15), 288.15 / 273.15, 1e-3);
  EXPECT_NEAR(air_at(300, 99000).pressure_pa / air_at(300).pressure_pa, 99000.0 / 101325, 1e-12);
}

TEST(Barometer, WithoutErrorsStatesThePressure) {
  Barometer barometer(perfect_barometer(), 1);
  const Pressure sample = barometer.measure(120, 30, 1);
  EXPECT_EQ(sample.measured_pa, sample.true_pa);
  EXPECT_EQ(sample.true_pa, air_at(120).pressure_pa);
  BarometerOptions options = perfect_barometer();
  options.airflow = -0.5;
  options.resolution_pa = 10;
  const double felt_pa = Barometer(options, 1).measure(120, 30, 1).measured_pa;
  EXPECT_NEAR(felt_pa, sample.true_pa - 0.5 * 0.5 * air_at(120).density_kgpm3() * 900, 5);
  EXPECT_NEAR(std::remainder(felt_pa, 10), 0, 1e-9);
}

TEST(Barometer, HasTheErrorsOfItsNumbers) {
  BarometerOptions options = perfect_barometer();
  options.noise_pa = 1.2;
  options.turn_on_pa = 75;
  options.drift_pa = 5;
  options.rate_hz = 0.1;
  double first2 = 0, step2 = 0, apart2 = 0;
  constexpr int kRuns = 2000;
  for (int run = 0; run < kRuns; ++run) {
    Barometer barometer(options, static_cast<std::uint64_t>(run));
    const auto error = [&] {
      const Pressure sample = barometer.measure(0, 0, 1);
      return sample.measured_pa - sample.true_pa;
    };
    const double first = error(), second = error();
    first2 += first * first;
    step2 += (second - first) * (second - first);
    double last = 0;
    for (int i = 0; i < 300; ++i) last = error();  // five time constants
    apart2 += (last - first) * (last - first);
  }
  // Four standard deviations of a variance from 2,000 values are 13 %.
  EXPECT_NEAR(first2 / kRuns / (75 * 75 + 25 + 1.44), 1, 0.13);
  const double kept = std::exp(-1 / 60.0);
  EXPECT_NEAR(step2 / kRuns / (2 * 1.44 + 50 * (1 - kept)), 1, 0.13);
  EXPECT_NEAR(apart2 / kRuns / (2 * 1.44 + 50 * (1 - std::exp(-5.0))), 1, 0.13);
}

// The air of the day changes, and the sensor warms up.
TEST(Barometer, FollowsWeatherAndTemperature) {
  BarometerOptions options = perfect_barometer();
  options.pressure_change_pa_h = -300;
  EXPECT_NEAR(Barometer(options, 1).measure(0, 0, 7200).measured_pa, 101325 - 600, 1e-6);
  options = perfect_barometer();
  options.temperature_pa_k = 0.75;
  options.sea_level_temperature_c = 25;
  Barometer barometer(options, 3);
  const auto at = [&](double t_s) { return barometer.measure(0, 0, t_s); };
  EXPECT_NEAR(at(0).measured_pa, 101325, 1e-9);  // 25 deg C, where it was calibrated
  EXPECT_NEAR(at(300).sensor_temperature_k, 298.15 + 10 * (1 - std::exp(-1)), 1e-9);
  const double per_kelvin_pa = (at(1e6).measured_pa - 101325) / 10;
  EXPECT_GT(std::abs(per_kelvin_pa), 0.01);
  EXPECT_NEAR(at(300).measured_pa, 101325 + per_kelvin_pa * 10 * (1 - std::exp(-1)), 1e-6);
  double squares = 0;
  for (int seed = 0; seed < 2000; ++seed) {
    const double error_pa =
        Barometer(options, static_cast<std::uint64_t>(seed)).measure(0, 0, 1e6).measured_pa - 101325;
    squares += error_pa * error_pa / 100;
  }
  EXPECT_NEAR(squares / 2000 / (0.75 * 0.75), 1, 0.13);
}

TEST(Barometer, HasTheNumbersOfItsPart) {
  BarometerOptions options;
  options.profile = BarometerProfile::Bmp388;
  options.noise_pa = 3;
  const BarometerNumbers numbers = barometer_numbers(options);
  EXPECT_EQ(numbers.noise_pa, 3);
  EXPECT_EQ(numbers.turn_on_pa, 50);
  EXPECT_EQ(numbers.temperature_pa_k, 0.75);
}

TEST(Barometer, RefusesNumbersOutOfRange) {
  BarometerOptions options;
  options.airflow = 3;
  EXPECT_THROW(Barometer(options, 1), InputError);
  options = {};
  options.sea_level_pressure_pa = 1013.25;  // hPa
  EXPECT_THROW(Barometer(options, 1), InputError);
}

}  // namespace
}  // namespace canyon::inertial
