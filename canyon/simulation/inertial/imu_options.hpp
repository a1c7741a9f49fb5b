#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "canyon/base/options/fwd.hpp"

namespace canyon::inertial {

/// Sensor classes. They set the numbers that are not given; docs/imu.md has their sources.
enum class ImuProfile : std::uint8_t { Ideal, Consumer, Automotive, Tactical };
/// Axes of the samples: forward, left, up (ROS) or forward, right, down (aviation).
enum class ImuAxes : std::uint8_t { Flu, Frd };

/// Rotation of a sensor relative to the vehicle [deg]; yaw is applied first, then pitch, then roll.
struct SensorOrientation {
  double roll_deg = 0, pitch_deg = 0, yaw_deg = 0;
};
/// Rotates vectors from a sensor's axes to the vehicle's: forward, left, up.
[[nodiscard]] Eigen::Matrix3d body_from_sensor(const SensorOrientation& orientation, ImuAxes axes);
void visit_axes(options::Visitor& v, ImuAxes& axes);
void visit_orientation(options::Visitor& v, SensorOrientation& orientation);

/// Errors of three gyroscopes; empty: from the profile. Numbers that differ by axis: standard deviations.
struct GyroscopeOptions {
  std::optional<double> angle_random_walk_deg_sqrt_h;   ///< white noise of the rate
  std::optional<double> bias_instability_deg_h;         ///< lowest Allan deviation
  std::optional<double> rate_random_walk_deg_h_sqrt_h;  ///< of the bias
  std::optional<double> turn_on_bias_deg_s;
  std::optional<double> scale_ppm, misalignment_deg;
  std::optional<double> g_sensitivity_deg_h_g;          ///< of an axis to the specific force along it
  std::optional<double> resolution_deg_s, range_deg_s;  ///< 0: not rounded; infinity: no limit
  std::optional<double> temperature_deg_h_k;            ///< of the bias by K from 25 deg C
  std::optional<double> scale_temperature_ppm_k;        ///< of the scale factor, likewise
};

/// Errors of three accelerometers, likewise.
struct AccelerometerOptions {
  std::optional<double> velocity_random_walk_mps_sqrt_h;
  std::optional<double> bias_instability_mg;
  std::optional<double> acceleration_random_walk_mg_sqrt_h;
  std::optional<double> turn_on_bias_mg;
  std::optional<double> scale_ppm, misalignment_deg;
  std::optional<double> resolution_mg, range_g;
  std::optional<double> temperature_mg_k, scale_temperature_ppm_k;
};

/// The temperature of the sensor: that of the air, and its own warming since the run began.
struct ImuTemperatureOptions {
  double air_c = 25;            ///< [-60, 85]
  double warming_k = 0;         ///< in the end, [-100, 100]
  double warming_time_s = 300;  ///< time constant of that, [1, 100000]
};

/// Vibration by rotors, an engine or a road: a narrow band on each axis, with independent phases.
struct VibrationOptions {
  double frequency_hz = 100;     ///< (0, 100,000]
  double bandwidth_hz = 0;       ///< full width at half the power, [0, 1000]; 0: a sinusoid
  double acceleration_mps2 = 0;  ///< amplitude: sqrt(2) times the effective value, [0, 1000]
  double rate_deg_s = 0;         ///< likewise, [0, 1000]
};

/// An interval in which a sensor fails, in seconds since the start of the run.
struct SensorFault {
  double from_s = 0, until_s = 0;  ///< [0, 1e8]
  double factor = 1;               ///< wheels: measured distance over the true one, [0, 100]

  [[nodiscard]] bool holds(double time_s) const { return time_s > from_s && time_s <= until_s; }
};
/// Visits the interval only.
void visit(options::Visitor& v, SensorFault& o);

/// An inertial measurement unit on the vehicle: gyroscopes and accelerometers at one point.
struct ImuOptions {
  ImuProfile profile = ImuProfile::Automotive;
  double rate_hz = 100;  ///< [1, 10,000]
  ImuAxes axes = ImuAxes::Flu;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< forward, left, up from the trajectory's point
  SensorOrientation orientation;
  GyroscopeOptions gyroscope;
  AccelerometerOptions accelerometer;
  ImuTemperatureOptions temperature;
  std::vector<VibrationOptions> vibration;
  double time_offset_s = 0, time_jitter_s = 0;  ///< of the time stamps, [-10, 10], [0, 1]
  double lost = 0;                              ///< fraction of samples, [0, 1)
  std::vector<SensorFault> frozen;              ///< the last sample is repeated, with new times
};

/// Errors of three equal sensors in SI units.
struct TriadNumbers {
  double white = 0;             ///< density of the white noise [unit / sqrt(Hz)]
  double flicker = 0;           ///< lowest Allan deviation of the 1/f noise [unit]
  double walk = 0;              ///< density of the bias's rate [unit / s / sqrt(Hz)]
  double turn_on = 0;           ///< [unit]
  double scale = 0;             ///< relative
  double misalignment = 0;      ///< [rad]
  double per_force = 0;         ///< [unit / (m/s^2)]
  double resolution = 0;        ///< [unit]; 0: not rounded
  double range = 0;             ///< [unit]; infinity: none
  double per_kelvin = 0;        ///< [unit / K]
  double scale_per_kelvin = 0;  ///< relative [1 / K]
};
struct ImuNumbers {
  TriadNumbers gyroscope;      ///< rad/s
  TriadNumbers accelerometer;  ///< m/s^2
};
/// The numbers of the options; empty ones from the profile.
[[nodiscard]] ImuNumbers imu_numbers(const ImuOptions& options);

/// Standard gravity [m/s^2], CGPM 1901: 1 g of data sheets.
inline constexpr double kStandardGravity = 9.80665;

void visit(options::Visitor& v, ImuOptions& o);

/// Converts a vector between axes.
[[nodiscard]] inline Eigen::Vector3d in_axes(const Eigen::Vector3d& v, ImuAxes from, ImuAxes to) {
  return from == to ? v : Eigen::Vector3d(v.x(), -v.y(), -v.z());
}

inline constexpr double kZeroCelsius_k = 273.15;
/// Calibration temperature of sensors: temperature-dependent errors are zero there.
inline constexpr double kCalibrated_k = kZeroCelsius_k + 25;

/// How much warmer than the air a sensor is `t_s` after it was turned on: w (1 - exp(-t / T)).
/// @param final_k w; @param time_constant_s T, above 0
[[nodiscard]] inline double warming_k(double final_k, double time_constant_s, double t_s) {
  return -final_k * std::expm1(-std::max(t_s, 0.0) / time_constant_s);
}

}  // namespace canyon::inertial
