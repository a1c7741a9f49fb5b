#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/positioning/fusion/dead_reckoning.hpp"

// Error states of the inertial filter and their equations. Private to canyon/receiver/positioning/fusion.

namespace canyon::positioning {

/// An inertial sensor's position and motion in Earth-fixed axes (ECEF). Body: forward, left, up.
struct InertialState {
  geodesy::GpsTime time;
  Eigen::Quaterniond ecef_from_body = Eigen::Quaterniond::Identity();
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();

  [[nodiscard]] Eigen::Matrix3d rotation() const { return ecef_from_body.toRotationMatrix(); }
};

/// The rotation about `rotation` by its length [rad].
[[nodiscard]] Eigen::Quaterniond rotation_of(const Eigen::Vector3d& rotation);

/// The matrix of the cross product: skew(a) b = a x b.
[[nodiscard]] Eigen::Matrix3d skew(const Eigen::Vector3d& a);

/// Propagates a state over an interval (Groves, Principles of GNSS, Inertial, and Multisensor Integrated
/// Navigation Systems, 2nd ed., 5.3: ECEF mechanisation, with the rotation of the body during the interval,
/// 5.5): attitude, velocity, position. The errors are of the third order of `dt_s`.
/// @param motion means over it, corrected @param gravity_mps2 at the position (geodesy::normal_gravity())
void carry(InertialState& state, const ImuReading& motion, double dt_s, const Eigen::Vector3d& gravity_mps2);

/// Truth minus estimate: attitude (a small rotation in ECEF), velocity and position of the sensor, biases of
/// accelerometers and gyroscopes (body), scale of the wheels, scale of the gyroscope about the up axis.
inline constexpr int kAttitudeError = 0;
inline constexpr int kVelocityError = 3;
inline constexpr int kPositionError = 6;
inline constexpr int kAccelerometerBias = 9;
inline constexpr int kGyroscopeBias = 12;
inline constexpr int kWheelScale = 15;
inline constexpr int kRotationScale = 16;
inline constexpr int kInertialErrors = 17;
using ErrorVector = Eigen::Matrix<double, kInertialErrors, 1>;
using ErrorMatrix = Eigen::Matrix<double, kInertialErrors, kInertialErrors>;

/// Estimated errors of the sensors: measured = true + bias, or true (1 + scale) if there is a scale.
struct SensorErrors {
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();  ///< [m/s^2]
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Zero();      ///< [rad/s]
  double wheel_scale = 0, rotation_scale = 0;

  [[nodiscard]] ImuReading corrected(const ImuReading& reading) const;
};

/// M simultaneous measurements: innovation = gradient . error + noise.
template <int M>
struct Innovation {
  Eigen::Matrix<double, M, kInertialErrors> gradient = Eigen::Matrix<double, M, kInertialErrors>::Zero();
  Eigen::Matrix<double, M, 1> value = Eigen::Matrix<double, M, 1>::Zero();
  Eigen::Matrix<double, M, M> noise = Eigen::Matrix<double, M, M>::Zero();  ///< covariance
};

/// The estimate with its covariance.
class InertialEstimate {
 public:
  InertialState state;
  SensorErrors sensors;
  ErrorMatrix p = ErrorMatrix::Zero();

  /// Propagates the covariance over `dt_s` (Groves 14.2.3, with errors as truth minus estimate). @param
  /// motion means over it, corrected @param gravity_mps2 at the position
  void predict(const ImuReading& motion, double dt_s, const Eigen::Vector3d& gravity_mps2,
               const SensorMounting& sensors_of);

  /// Squared innovation over its variance: chi-square of M degrees of freedom.
  template <int M>
  [[nodiscard]] double distance2(const Innovation<M>& z) const {
    const auto [ph, s] = spread(z);
    return z.value.dot(s.inverse() * z.value);
  }
  /// Kalman update; the estimated error is moved into the estimate.
  template <int M>
  void take(const Innovation<M>& z) {
    const auto [ph, s] = spread(z);
    const Eigen::Matrix<double, kInertialErrors, M> gain = ph * s.inverse();
    p.noalias() -= gain * ph.transpose();
    symmetrize();
    correct(gain * z.value);
  }

 private:
  template <int M>
  struct Spread {
    Eigen::Matrix<double, kInertialErrors, M> ph;  ///< P H^T
    Eigen::Matrix<double, M, M> s;                 ///< H P H^T + R
  };
  template <int M>
  [[nodiscard]] Spread<M> spread(const Innovation<M>& z) const {
    Spread<M> result;
    result.ph = p * z.gradient.transpose();
    result.s = z.gradient * result.ph + z.noise;
    return result;
  }
  /// Makes the covariance symmetric, with positive variances.
  void symmetrize();
  void correct(const ErrorVector& error);
};

}  // namespace canyon::positioning
