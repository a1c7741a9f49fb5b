#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "canyon/geodesy/gps_time.hpp"

namespace canyon::positioning {

/// An inertial sensor's place and motion in axes fixed to the Earth (ECEF). Body: forward, left, up.
struct InertialState {
  geodesy::GpsTime time;
  Eigen::Quaterniond ecef_from_body = Eigen::Quaterniond::Identity();
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();

  [[nodiscard]] Eigen::Matrix3d rotation() const { return ecef_from_body.toRotationMatrix(); }
};

/// Readings of a sensor without errors: means over an interval.
struct FeltMotion {
  Eigen::Vector3d specific_force_mps2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_rate_radps = Eigen::Vector3d::Zero();  ///< against inertial space
};

/// The turn about `turn` by its length [rad].
[[nodiscard]] Eigen::Quaterniond rotation_of(const Eigen::Vector3d& turn);

/// The matrix of the cross product: skew(a) b = a x b.
[[nodiscard]] Eigen::Matrix3d skew(const Eigen::Vector3d& a);

/// Carries a state over an interval (Groves, Principles of GNSS, Inertial, and Multisensor Integrated
/// Navigation Systems, 2nd ed., 5.3: ECEF mechanisation, with the rotation of the body during the interval,
/// 5.5): attitude, velocity, position. The errors are of the third order of `dt_s`.
/// @param gravity_mps2 at the place (geodesy::normal_gravity())
void carry(InertialState& state, const FeltMotion& felt, double dt_s, const Eigen::Vector3d& gravity_mps2);

}  // namespace canyon::positioning
