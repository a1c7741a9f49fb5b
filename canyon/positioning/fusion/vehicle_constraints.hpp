#pragma once

#include <Eigen/Core>

#include "canyon/positioning/fusion/dead_reckoning_options.hpp"
#include "canyon/positioning/fusion/inertial_errors.hpp"

// Private to canyon/positioning/fusion.

namespace canyon::positioning {

/// Constraints on a vehicle's motion by its build: the speed of its wheels (Groves 16.3), no speed across
/// (15.2.2), none at all at rest (15.3).
class VehicleConstraints {
 public:
  VehicleConstraints(const DeadReckoningOptions& options, const SensorMounting& mounting)
      : options_(options), mounting_(mounting) {}

  /// The vehicle moved for `dt_s`.
  void move(const InertialEstimate& estimate, const FeltMotion& felt, double dt_s);
  /// Rate of the body against the Earth, in its axes [rad/s].
  [[nodiscard]] Eigen::Vector3d rate(const InertialEstimate& estimate) const;

  void take_wheels(InertialEstimate& estimate, const WheelReading& reading);
  /// The axle moves along the vehicle's axis. @param since_s the last time that this was taken
  void take_way(InertialEstimate& estimate, double since_s) const;
  /// The vehicle stands. @param mean of its sensor's readings
  void take_rest(InertialEstimate& estimate, const ImuReading& mean, double since_s) const;

 private:
  /// Velocity of the axle's middle in the body's axes, and how it depends on the errors.
  [[nodiscard]] Eigen::Vector3d axle_velocity(const InertialEstimate& estimate) const;
  [[nodiscard]] Eigen::Matrix<double, 3, kInertialErrors> axle_gradient(
      const InertialEstimate& estimate) const;

  DeadReckoningOptions options_;
  SensorMounting mounting_;
  Eigen::Vector3d felt_radps_ = Eigen::Vector3d::Zero();  // of the last reading
  double way_m_ = 0, moved_s_ = 0;                        // forwards, since the wheels' last reading
};

}  // namespace canyon::positioning
