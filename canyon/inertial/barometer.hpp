#pragma once

#include <cstdint>

#include "canyon/base/random.hpp"
#include "canyon/inertial/barometer_options.hpp"
#include "canyon/inertial/imu_options.hpp"

namespace canyon::inertial {

/// Air at a height.
struct Air {
  double pressure_pa = 0, temperature_k = 0;
  [[nodiscard]] double density_kgpm3() const;
};

/// The standard atmosphere (ICAO Doc 7488, U.S. Standard Atmosphere 1976) with another pressure and
/// temperature at sea level: each layer is as much warmer as sea level is.
/// @param height_m above mean sea level, [-1000, 47000]; beyond, the value of the nearer end
[[nodiscard]] Air air_at(double height_m, double sea_level_pressure_pa = 101325,
                         double sea_level_temperature_k = 288.15);
/// The height in the standard atmosphere that has this pressure [m]: what altimeters set to 1013.25 hPa show.
/// @param pressure_pa above 0
[[nodiscard]] double pressure_altitude_m(double pressure_pa);

/// A sample of a pressure sensor.
struct Pressure {
  double measured_pa = 0;
  double true_pa = 0;               ///< of the air that the sample states
  double temperature_k = 0;         ///< of the air
  double sensor_temperature_k = 0;  ///< of the sensor, which warms up
};

/// A pressure sensor: noise, an error of the run, a slow Gauss-Markov error, one by its temperature, the
/// pressure of the airflow, and its resolution. The same seed gives the same errors.
class Barometer {
 public:
  Barometer(const BarometerOptions& options, std::uint64_t seed);
  /// The next sample, of the air at `t_s` since the run began.
  /// @param height_m of the sensor above mean sea level
  [[nodiscard]] Pressure measure(double height_m, double speed_mps, double t_s);
  /// The air at a height at `t_s`.
  [[nodiscard]] Air air(double height_m, double t_s) const;

 private:
  BarometerOptions options_;
  BarometerNumbers numbers_;
  RandomStream random_;
  double turn_on_pa_, drift_pa_, per_kelvin_pa_;
};

}  // namespace canyon::inertial
