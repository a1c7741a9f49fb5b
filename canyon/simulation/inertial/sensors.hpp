#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "canyon/base/random.hpp"
#include "canyon/simulation/inertial/imu.hpp"
#include "canyon/simulation/inertial/imu_options.hpp"
#include "canyon/simulation/inertial/sensor_options.hpp"

namespace canyon::inertial {

/// Air at a height.
struct Air {
  double pressure_pa = 0, temperature_k = 0;
  [[nodiscard]] double density_kgpm3() const;
};

/// The standard atmosphere (ICAO Doc 7488, U.S. Standard Atmosphere 1976) with another pressure and
/// temperature at sea level. All layers have the same temperature offset as sea level. @param height_m above
/// mean sea level, [-1000, 47000]; outside, the value of the nearer end
[[nodiscard]] Air air_at(double height_m, double sea_level_pressure_pa = 101325,
                         double sea_level_temperature_k = 288.15);
/// The height in the standard atmosphere with this pressure [m], as altimeters set to 1013.25 hPa show it.
/// @param pressure_pa above 0
[[nodiscard]] double pressure_altitude_m(double pressure_pa);

/// A sample of a pressure sensor.
struct Pressure {
  double measured_pa = 0;
  double true_pa = 0;               ///< pressure of the air at the sensor's height
  double temperature_k = 0;         ///< of the air
  double sensor_temperature_k = 0;  ///< of the sensor, which warms up
};

/// A pressure sensor: noise, an error of the run, a slow Gauss-Markov error, an error by temperature, the
/// pressure of the airflow, and its resolution. The same seed gives the same errors.
class Barometer {
 public:
  Barometer(const BarometerOptions& options, std::uint64_t seed);
  /// The next sample, of the air at `t_s` since the start of the run.
  /// @param height_m of the sensor above mean sea level
  [[nodiscard]] Pressure measure(double height_m, double speed_mps, double t_s);
  [[nodiscard]] Air air(double height_m, double t_s) const;

 private:
  BarometerOptions options_;
  BarometerNumbers numbers_;
  RandomStream random_;
  double turn_on_pa_, drift_pa_, per_kelvin_pa_;
};

/// A magnetometer: y = (I + M) (field + roadside field) + hard iron + 1/f and white noise, rounded and
/// limited. The roadside field (of steel) is a Gauss-Markov process over the travelled distance, in ENU axes.
/// The same seed gives the same errors.
class Magnetometer {
 public:
  Magnetometer(const MagnetometerOptions& options, std::uint64_t seed);
  /// The next sample [T], in the sensor's axes.
  /// @param field_enu_t Earth's field @param enu_from_sensor the sensor's attitude
  /// @param travelled_m distance travelled since the last sample, at least 0
  [[nodiscard]] Eigen::Vector3d measure(const Eigen::Vector3d& field_enu_t,
                                        const Eigen::Matrix3d& enu_from_sensor, double travelled_m);

 private:
  MagnetometerOptions options_;
  RandomStream random_, steel_random_;
  Triad triad_;
  Eigen::Vector3d steel_enu_t_;
};

/// Values of the left and the right wheel.
using WheelPair = std::array<double, 2>;

/// The wheels at the end of an interval.
struct WheelSample {
  WheelPair speed_mps{};  ///< means of the interval; never below 0 without direction
  std::optional<std::array<std::int64_t, 2>> ticks;  ///< counted since the start; empty: not rounded
};

/// Sensors of two wheels: distance (1 + scale + slip), counted in ticks. Equal seeds give equal errors.
class Wheels {
 public:
  Wheels(const WheelOptions& options, std::uint64_t seed);
  /// The next sample. @param travelled_m forward distance of each wheel in `dt_s`; dt_s is above 0
  [[nodiscard]] WheelSample measure(const WheelPair& travelled_m, double dt_s);

 private:
  struct Wheel {
    double scale = 0, slip = 0;
    double counted_m = 0;   ///< distance that the sensor has measured
    double reported_m = 0;  ///< reported part of it, in whole ticks
  };
  WheelOptions options_;
  RandomStream random_;
  std::array<Wheel, 2> wheels_;
};

}  // namespace canyon::inertial
