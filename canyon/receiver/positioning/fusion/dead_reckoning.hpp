#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/receiver/positioning/fix.hpp"

namespace canyon::positioning {

/// A receiver that goes on by the vehicle's inertial sensor and wheels (DeadReckoning).
struct DeadReckoningOptions {
  bool enabled = false;
  /// The vehicle moves along its own axis, as cars and trains do: it neither slides sideways nor leaves the
  /// road.
  bool non_holonomic = true;
  /// Standard deviations [m/s] of the speeds across, (0, 10].
  double sideways_mps = 0.1, upwards_mps = 0.1;
  /// Slower than this, the course says nothing of the heading [m/s], (0, 100].
  double alignment_speed_mps = 3;
  /// Fixes and velocities beyond so many standard deviations are left out [1], > 0.
  double gate_sigmas = 4;
  /// Errors of fixes last until the antenna has moved so far [m], (0, 1e5], or for so long [s], (0, 3600].
  double error_distance_m = 60, error_height_distance_m = 500, error_time_s = 60;
  /// Errors from space, which do not change in a drive: standard deviation of a range [m], [0, 100]. Stated
  /// accuracies of positions without corrections have them.
  double space_sigma_m = 2;
  /// After so long with fixes that all fail the test, the filter doubts itself [s], (0, 3600].
  double astray_s = 20;
  /// A position of a larger standard deviation (root of the sum of the three variances) [m] is none.
  double max_sigma_m = 100;
};
void visit(options::Visitor& v, DeadReckoningOptions& o);

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

/// Fixes and the vehicle's sensors together: an error-state Kalman filter of 17 states about a strapdown
/// mechanisation in ECEF, loosely coupled (Groves, Principles of GNSS, Inertial, and Multisensor Integrated
/// Navigation Systems, 2nd ed., 14.2 and 14.3; wheels and constraints 16.3 and 15.2).
///
/// It waits for a motion that tells the heading (FusionPhase::Initialising: the fixes are answered as they
/// are), then answers its own position of the antenna. Fixes count by their stated covariance, and those
/// beyond the gate are left out. Errors of fixes last: each one counts as the new part that it has since the
/// one before, by time and way. Between fixes and without them the position goes on, and its stated
/// covariance grows. One receiver's filter; same inputs, same answers.
class DeadReckoning {
 public:
  DeadReckoning(const DeadReckoningOptions& options, const SensorMounting& mounting);
  ~DeadReckoning();
  DeadReckoning(DeadReckoning&&) noexcept;
  DeadReckoning& operator=(DeadReckoning&&) noexcept;

  /// An epoch's answer. Times must not run backwards.
  /// @param readings that ended since the epoch before, in order
  /// @param fix of the epoch's satellites, as the receiver would state it without sensors
  [[nodiscard]] Fix update(geodesy::GpsTime time, const SensorReadings& readings, const Fix& fix);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace canyon::positioning
