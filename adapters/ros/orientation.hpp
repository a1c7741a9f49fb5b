#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <optional>

#include "adapters/ros/conversions.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"

namespace canyon::ros_messages {

/// autoware_sensing_msgs/GnssInsOrientationStamped of a receiver with the vehicle's attitude, from the
/// vehicle's sensors or from two antennas in its direction of travel. From forward, left, up to east, north,
/// up. Errors are standard deviations [rad]; 1 for angles that are not measured or have no reported accuracy:
/// the roll of two antennas, roll and pitch of sensors. Empty without an attitude.
template <class GnssInsOrientationStamped>
[[nodiscard]] std::optional<GnssInsOrientationStamped> orientation_message(const Head& head,
                                                                           const simulation::Epoch* epoch) {
  if (!detail::has_fix(epoch)) return std::nullopt;
  const positioning::Fix& fix = epoch->observed.fix;
  constexpr float kUnknown_rad = 1;
  double heading_rad = 0, pitch_rad = 0, roll_rad = 0, heading_sigma_rad = 0;
  float pitch_sigma_rad = kUnknown_rad;
  if (fix.fused()) {
    heading_rad = fix.fusion->heading_rad;
    pitch_rad = fix.fusion->pitch_rad;
    roll_rad = fix.fusion->roll_rad;
    heading_sigma_rad = fix.fusion->heading_sigma_rad;
  } else if (encoding::heading_deg(fix, 3)) {
    const positioning::Baseline& baseline = *fix.baseline;
    heading_rad = baseline.heading_rad();
    pitch_rad = baseline.pitch_rad();
    heading_sigma_rad = baseline.heading_sigma_rad();
    pitch_sigma_rad = static_cast<float>(std::sqrt(baseline.covariance_enu(2, 2)) / baseline.length_m());
  } else {
    return std::nullopt;
  }
  GnssInsOrientationStamped message;
  detail::set_header(message.header, head);
  const Eigen::Quaterniond rotation =
      Eigen::AngleAxisd(geodesy::kPi / 2 - heading_rad, Eigen::Vector3d::UnitZ()) *
      Eigen::AngleAxisd(-pitch_rad, Eigen::Vector3d::UnitY()) *
      Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX());
  auto& orientation = message.orientation.orientation;
  orientation.x = rotation.x();
  orientation.y = rotation.y();
  orientation.z = rotation.z();
  orientation.w = rotation.w();
  message.orientation.rmse_rotation_x = kUnknown_rad;
  message.orientation.rmse_rotation_y = pitch_sigma_rad;
  message.orientation.rmse_rotation_z = static_cast<float>(heading_sigma_rad);
  return message;
}

}  // namespace canyon::ros_messages
