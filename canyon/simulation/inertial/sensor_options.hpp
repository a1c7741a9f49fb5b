#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "canyon/base/options/fwd.hpp"
#include "canyon/simulation/inertial/imu_options.hpp"

namespace canyon::inertial {

/// Models of sensors. They set the numbers that are not given; docs/imu.md has their sources.
enum class BarometerProfile : std::uint8_t { Ideal, Ms5611, Bmp388 };

/// A pressure sensor and the air, by default a calm standard atmosphere. Empty numbers: from the profile.
struct BarometerOptions {
  BarometerProfile profile = BarometerProfile::Ms5611;
  double rate_hz = 25;                                   ///< samples, [0.1, 1000]
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< forward, left, up from the trajectory's point
  double sea_level_pressure_pa = 101325;                 ///< of the day, [85000, 110000]
  double sea_level_temperature_c = 15;                   ///< of the day, [-60, 50]
  double pressure_change_pa_h = 0;                       ///< of the day's pressure, [-2000, 2000]
  std::optional<double> noise_pa;                        ///< standard deviation of a sample, [0, 1000]
  std::optional<double> turn_on_pa;                      ///< standard deviation of the run's error, [0, 5000]
  std::optional<double> drift_pa;          ///< standard deviation of the slowly varying error, [0, 5000]
  std::optional<double> temperature_pa_k;  ///< standard deviation of the error by temperature, [0, 100]
  double airflow = 0;                      ///< fraction of the dynamic pressure that is measured, [-2, 2]
  std::optional<double> resolution_pa;     ///< step of the reading, [0, 1000]; 0: none
};

/// Errors of a pressure sensor, in the units of the options.
struct BarometerNumbers {
  double noise_pa = 0, turn_on_pa = 0, drift_pa = 0, temperature_pa_k = 0, resolution_pa = 0;
};
/// The numbers of the options; empty ones from the profile.
[[nodiscard]] BarometerNumbers barometer_numbers(const BarometerOptions& options);

void visit(options::Visitor& v, BarometerOptions& o);

/// Models of sensors. They set the numbers that are not given; docs/imu.md has their sources.
enum class MagnetometerProfile : std::uint8_t { Ideal, Ist8310, Rm3100 };

/// A magnetometer of three axes on the vehicle. Empty numbers: from the profile.
struct MagnetometerOptions {
  MagnetometerProfile profile = MagnetometerProfile::Ist8310;
  double rate_hz = 50;  ///< samples, [0.1, 1000]
  ImuAxes axes = ImuAxes::Flu;
  SensorOrientation orientation;
  std::optional<double> noise_ut;             ///< standard deviation of a sample, [0, 100]
  std::optional<double> bias_instability_ut;  ///< lowest Allan deviation, [0, 100]
  std::optional<double> hard_iron_ut;         ///< standard deviation of the field of the vehicle, [0, 1000]
  std::optional<double> soft_iron;            ///< standard deviation of each element of I + M, [0, 1]
  std::optional<double> resolution_ut;        ///< step of the reading, [0, 100]; 0: none
  std::optional<double> range_ut;             ///< largest value, (0, 1e6]; infinity: no limit
  double surroundings_ut = 0;  ///< standard deviation of the field of objects along the road, [0, 1000]
};

/// The numbers of the options; empty ones from the profile [T].
[[nodiscard]] TriadNumbers magnetometer_numbers(const MagnetometerOptions& options);

void visit(options::Visitor& v, MagnetometerOptions& o);

/// Sensors of the two wheels of an unsteered axle, whose middle is the trajectory's point.
struct WheelOptions {
  double rate_hz = 10;   ///< samples, [1, 1000]
  double track_m = 1.5;  ///< between the wheels, [0, 10]
  double tick_m = 0.02;  ///< distance of one tick, [0, 10]; 0: speeds are not rounded, and there are no ticks
  double scale = 0.005;  ///< standard deviation of each wheel's relative error of the run, [0, 0.2]
  double slip = 0.003;   ///< standard deviation of each wheel's relative slip, [0, 0.5]
  double slip_time_s = 1;          ///< time constant of the slip, [0.01, 1000]
  bool direction = true;           ///< the sensors distinguish forwards from backwards
  std::vector<SensorFault> slips;  ///< intervals in which they spin or block
};

void visit(options::Visitor& v, WheelOptions& o);

/// Sensors of the vehicle other than its receivers.
struct SensorOptions {
  std::optional<ImuOptions> imu;
  std::optional<WheelOptions> wheels;
  std::optional<BarometerOptions> barometer;
  std::optional<MagnetometerOptions> magnetometer;

  [[nodiscard]] bool any() const { return needs_smooth_motion() || barometer || magnetometer; }
  [[nodiscard]] bool needs_smooth_motion() const { return imu || wheels; }
};

void visit(options::Visitor& v, SensorOptions& o);

}  // namespace canyon::inertial
