#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>

#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/positioning/fusion/dead_reckoning.hpp"
#include "canyon/receiver/positioning/fusion/inertial_errors.hpp"

namespace canyon::positioning {

// Private to canyon/receiver/positioning/fusion.
/// Constraints on a vehicle's motion: speed of wheels (Groves 16.3), no speed across (15.2.2), rest (15.3).
class VehicleConstraints {
 public:
  VehicleConstraints(const DeadReckoningOptions& options, const SensorMounting& mounting)
      : options_(options), mounting_(mounting) {}

  /// The vehicle moved for `dt_s`.
  void move(const InertialEstimate& estimate, const ImuReading& motion, double dt_s);
  /// Rate of the body relative to the Earth, in body axes [rad/s].
  [[nodiscard]] Eigen::Vector3d rate(const InertialEstimate& estimate) const;

  void take_wheels(InertialEstimate& estimate, const WheelReading& reading);
  /// Applies the motion of the axle along the vehicle's axis. @param since_s time since the last application
  void apply_non_holonomic(InertialEstimate& estimate, double since_s) const;
  /// Applies the rest of the vehicle. @param mean of its sensor's readings
  void take_rest(InertialEstimate& estimate, const ImuReading& mean, double since_s) const;

 private:
  /// Velocity of the axle's middle in body axes, and its gradient by the errors.
  [[nodiscard]] Eigen::Vector3d axle_velocity(const InertialEstimate& estimate) const;
  [[nodiscard]] Eigen::Matrix<double, 3, kInertialErrors> axle_gradient(
      const InertialEstimate& estimate) const;

  DeadReckoningOptions options_;
  SensorMounting mounting_;
  Eigen::Vector3d rate_radps_ = Eigen::Vector3d::Zero();  // of the last reading
  double travelled_m_ = 0, moved_s_ = 0;  // distance and time forwards since the wheels' last reading
};

/// Detects from its sensors whether a vehicle is stationary: no wheel tick for half a second; without wheels
/// no change of the inertial readings for a second, at a known low speed.
class StandstillDetector {
 public:
  explicit StandstillDetector(const SensorMounting& mounting);

  void add(const ImuReading& reading);
  void add(const WheelReading& reading);
  /// @param speed_mps if known; empty: unknown
  [[nodiscard]] bool is_stationary(std::optional<double> speed_mps) const;
  /// Means over the last second.
  [[nodiscard]] ImuReading mean() const;
  /// A second of readings is available.
  [[nodiscard]] bool full() const { return readings_.size() >= window_; }

 private:
  [[nodiscard]] bool quiet() const;

  double force_limit_, rate_limit_;  // standard deviations of a sensor at rest
  std::size_t window_;
  bool has_wheels_;
  std::deque<ImuReading> readings_;
  Eigen::Vector3d force_ = Eigen::Vector3d::Zero(), rate_ = Eigen::Vector3d::Zero();    // sums
  Eigen::Vector3d force2_ = Eigen::Vector3d::Zero(), rate2_ = Eigen::Vector3d::Zero();  // of squares
  std::optional<geodesy::GpsTime> wheels_stopped_since_, last_wheel_;
};

/// The first estimate of a vehicle's attitude. At rest accelerometers give the vertical and gyroscopes their
/// biases; in motion the course of a fix gives the heading (Groves 5.6.3).
class InitialAttitude {
 public:
  explicit InitialAttitude(const SensorMounting& mounting) : mounting_(mounting) {}

  /// Processes rest of the vehicle. @param mean over a second
  void set_stationary(const ImuReading& mean);
  /// The estimate at a fix, once its course determines the heading. @param mean of the sensor near this time
  [[nodiscard]] std::optional<InertialEstimate> begin(const Fix& fix, const ImuReading& mean,
                                                      const DeadReckoningOptions& options) const;

 private:
  SensorMounting mounting_;
  std::optional<ImuReading> at_rest_;
};

}  // namespace canyon::positioning
