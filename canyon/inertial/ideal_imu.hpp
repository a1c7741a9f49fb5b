#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "canyon/inertial/imu_options.hpp"

namespace canyon::inertial {

/// A vehicle at an instant, in axes fixed to the Earth (ECEF). Its own axes are forward, left, up.
struct BodyState {
  Eigen::Vector3d position_m, velocity_mps, acceleration_mps2;  ///< and its derivatives
  Eigen::Matrix3d ecef_from_body;
};
/// By seconds. Its acceleration is continuous; differences of a smoother attitude have smaller errors.
using BodyMotion = std::function<BodyState(double)>;

/// The true input of an inertial sensor, in its axes.
struct ImuInput {
  Eigen::Vector3d specific_force_mps2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_rate_radps = Eigen::Vector3d::Zero();  ///< against inertial space
};

/// The sensor's own place and attitude at an instant.
struct ImuState {
  BodyState sensor;  ///< ecef_from_body: from the sensor's axes
  ImuInput input;
};

/// Sensors without errors on a moving vehicle, at instants in even steps: f = C (a + 2 w x v - g), with
/// Earth's rotation w and normal gravity g (Groves, Principles of GNSS, Inertial, and Multisensor Integrated
/// Navigation Systems, 2nd ed., 5.2); rates with Earth's rotation. Rates and the sensor's motion about the
/// vehicle's point are derivatives of the attitude by differences of fourth order.
class IdealImu {
 public:
  /// Instants are rounded to nanoseconds. @param motion is asked from -2 step_s on @param step_s above 0
  IdealImu(const ImuOptions& options, BodyMotion motion, double step_s);

  /// The state at the time `index` step_s, `index` at least 0.
  [[nodiscard]] ImuState at(std::int64_t index);
  /// Means over an interval, as sensors that integrate state them: of the specific force by Simpson's rule,
  /// with an error of the fourth order of the step; of the rate by the turns between attitudes, so that these
  /// add up to the attitude. @param to an even number of steps behind `from`
  [[nodiscard]] ImuInput mean(std::int64_t from, std::int64_t to);

 private:
  [[nodiscard]] const BodyState& body(std::int64_t index);
  /// The rotation vector from body(index) to body(index + 1), in the axes of either.
  [[nodiscard]] const Eigen::Vector3d& turn(std::int64_t index);

  /// Normal gravity at a place on the way, by its gradient within a metre of the last one that was computed.
  [[nodiscard]] Eigen::Vector3d gravity(const Eigen::Vector3d& place_m);

  static constexpr std::int64_t kKept = 8;
  BodyMotion motion_;
  double step_s_;
  Eigen::Vector3d position_m_;
  Eigen::Matrix3d body_from_sensor_;
  Eigen::Vector3d gravity_place_m_ = Eigen::Vector3d::Zero(), gravity_mps2_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d gravity_gradient_ = Eigen::Matrix3d::Zero();
  // The last ones that were asked for, by index modulo kKept.
  std::array<std::optional<std::pair<std::int64_t, BodyState>>, kKept> bodies_;
  std::array<std::optional<std::pair<std::int64_t, ImuState>>, kKept> states_;
  std::array<std::optional<std::pair<std::int64_t, Eigen::Vector3d>>, kKept> turns_;
};

}  // namespace canyon::inertial
