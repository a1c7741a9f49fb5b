#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"

namespace canyon::positioning {

/// Means of an inertial sensor over an interval, in the vehicle's axes: forward, left, up.
struct ImuReading {
  geodesy::GpsTime time;  ///< end of the interval, as the sensor states it
  Eigen::Vector3d specific_force_mps2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_rate_radps = Eigen::Vector3d::Zero();  ///< against inertial space
};

/// The mean speed of the middle of an axle that does not steer, over an interval.
struct WheelReading {
  geodesy::GpsTime time;  ///< end of the interval
  double dt_s = 0;        ///< its length
  double speed_mps = 0;
};

/// Readings of a vehicle's sensors since the epoch before, in order of time.
struct SensorReadings {
  std::vector<ImuReading> imu;
  std::vector<WheelReading> wheels;
};

/// Errors of three equal sensors as their maker knows them, in SI units: standard deviations.
struct TriadModel {
  double white = 0;     ///< density of the white noise [unit / sqrt(Hz)]
  double drift = 0;     ///< lowest Allan deviation of the bias [unit]
  double walk = 0;      ///< density of the bias's rate [unit / s / sqrt(Hz)]
  double bias = 0;      ///< of a run [unit]
  double scale = 0;     ///< relative
  double axes_rad = 0;  ///< of an axis towards each other one
};

struct WheelModel {
  double rate_hz = 10;
  double scale = 0;        ///< relative error of a run
  double slip = 0;         ///< relative
  double slip_time_s = 1;  ///< its time constant
  double step_mps = 0;     ///< of the speeds
  bool direction = true;   ///< speeds have a sign
};

/// The sensors on a vehicle, as a receiver is told of them.
struct SensorMounting {
  double imu_interval_s = 0.01;                         ///< above 0
  Eigen::Vector3d antenna_m = Eigen::Vector3d::Zero();  ///< from the inertial sensor: forward, left, up
  Eigen::Vector3d axle_m = Eigen::Vector3d::Zero();  ///< likewise, the middle of the axle that does not steer
  TriadModel gyroscope, accelerometer;
  std::optional<WheelModel> wheels;
};

}  // namespace canyon::positioning
