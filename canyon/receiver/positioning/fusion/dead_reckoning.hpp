#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/receiver/positioning/fix.hpp"

namespace canyon::positioning {

/// Options of a receiver with the vehicle's inertial sensor and wheels (DeadReckoning).
struct DeadReckoningOptions {
  bool enabled = false;
  /// The vehicle moves along its own axis, like cars and trains: no speed sideways or up.
  bool non_holonomic = true;
  /// Standard deviations [m/s] of the speeds across, (0, 10].
  double sideways_mps = 0.1, upwards_mps = 0.1;
  /// At lower speeds the course does not determine the heading [m/s], (0, 100].
  double alignment_speed_mps = 3;
  /// Fixes and velocities beyond this many standard deviations are rejected [1], > 0.
  double gate_sigmas = 4;
  /// Correlation of errors of fixes: over this antenna motion [m], (0, 1e5], or this time [s], (0, 3600].
  double error_distance_m = 60, error_height_distance_m = 500, error_time_s = 60;
  /// Errors in space, which are constant during a drive: standard deviation of a range [m], [0, 100].
  /// Included in the reported accuracies of positions without corrections.
  double space_sigma_m = 2;
  /// If all fixes fail the test for this time, the filter inflates its covariance [s], (0, 3600].
  double astray_s = 20;
  /// Larger standard deviations (root of the sum of the three variances) [m] make a position invalid.
  double max_sigma_m = 100;
};
void visit(options::Visitor& v, DeadReckoningOptions& o);

/// Means of an inertial sensor over an interval, in the vehicle's axes: forward, left, up.
struct ImuReading {
  geodesy::GpsTime time;  ///< end of the interval, by the sensor's clock
  Eigen::Vector3d specific_force_mps2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_rate_radps = Eigen::Vector3d::Zero();  ///< against inertial space
};

/// The mean speed of the middle of a non-steering axle, over an interval.
struct WheelReading {
  geodesy::GpsTime time;  ///< end of the interval
  double dt_s = 0;        ///< its length
  double speed_mps = 0;
};

/// Readings of a vehicle's sensors since the last epoch, in order of time.
struct SensorReadings {
  std::vector<ImuReading> imu;
  std::vector<WheelReading> wheels;
};

/// Error model of three equal sensors, in SI units: standard deviations.
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

/// The sensors on a vehicle, as configured in a receiver.
struct SensorMounting {
  double imu_interval_s = 0.01;                         ///< above 0
  Eigen::Vector3d antenna_m = Eigen::Vector3d::Zero();  ///< from the inertial sensor: forward, left, up
  Eigen::Vector3d axle_m = Eigen::Vector3d::Zero();     ///< likewise, the middle of the non-steering axle
  TriadModel gyroscope, accelerometer;
  std::optional<WheelModel> wheels;
};

/// Fusion of fixes and the vehicle's sensors: an error-state Kalman filter of 17 states with a strapdown
/// mechanisation in ECEF, loosely coupled (Groves, Principles of GNSS, Inertial, and Multisensor Integrated
/// Navigation Systems, 2nd ed., 14.2 and 14.3; wheels and constraints 16.3 and 15.2).
///
/// Until motion determines the heading (FusionPhase::Initialising) it returns the fixes unchanged, then its
/// own position of the antenna. Fixes are weighted by their reported covariance; those beyond the gate are
/// rejected. Errors of fixes are correlated: each fix counts only by the part of its error that is new since
/// the last one, by time and distance. Without fixes the position is propagated, and its reported covariance
/// grows. One receiver's filter; deterministic.
class DeadReckoning {
 public:
  DeadReckoning(const DeadReckoningOptions& options, const SensorMounting& mounting);
  ~DeadReckoning();
  DeadReckoning(DeadReckoning&&) noexcept;
  DeadReckoning& operator=(DeadReckoning&&) noexcept;

  /// Computes an epoch. Times must not run backwards.
  /// @param readings that ended since the last epoch, in order
  /// @param fix of the epoch's satellites, as reported without sensors
  [[nodiscard]] Fix update(geodesy::GpsTime time, const SensorReadings& readings, const Fix& fix);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace canyon::positioning
