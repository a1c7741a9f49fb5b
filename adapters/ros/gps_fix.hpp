#pragma once

#include <algorithm>
#include <cmath>

#include "adapters/ros/conversions.hpp"

namespace canyon::ros_messages {

namespace detail {

/// Of a normal variable 95 % are within two standard deviations.
[[nodiscard]] inline double two_sigma(double variance) {
  return 2 * std::sqrt(variance);
}

/// Older messages have no codes for RTK.
template <class Status>
[[nodiscard]] std::int16_t gps_status_code(positioning::FixKind kind) {
  const encoding::FixCodes& codes = encoding::codes_of(kind);
  if constexpr (!requires { Status::STATUS_RTK_FIX; })
    if (kind == positioning::FixKind::Float || kind == positioning::FixKind::Fixed)
      return codes.navsat_status;
  return codes.gps_status;
}

template <class Status>
void set_gps_status(Status& status, const simulation::Epoch& epoch) {
  using Number = std::remove_reference_t<decltype(status.satellites_used)>;
  const receiver::ReceiverEpoch& observed = epoch.observed;
  const positioning::Fix& fix = observed.fix;
  if (fix.solved())
    for (const gnss::SatelliteId id : fix.used) status.satellite_used_prn.push_back(prn_number(id));
  for (const receiver::SatelliteObservation& seen : observed.satellites) {
    if (!seen.measurement) continue;
    const auto rounded = [](double value) { return static_cast<std::int32_t>(std::lround(value)); };
    status.satellite_visible_prn.push_back(prn_number(seen.id));
    status.satellite_visible_z.push_back(rounded(geodesy::degrees(seen.elevation_rad)));
    status.satellite_visible_azimuth.push_back(rounded(geodesy::degrees(seen.azimuth_rad)));
    status.satellite_visible_snr.push_back(rounded(seen.measurement->cn0_dbhz.value_or(0)));
  }
  status.satellites_used = static_cast<Number>(status.satellite_used_prn.size());
  status.satellites_visible = static_cast<Number>(status.satellite_visible_prn.size());
  const int sensors = fix.fused() ? Status::SOURCE_GYRO | Status::SOURCE_ACCEL : Status::SOURCE_NONE;
  status.status = gps_status_code<Status>(fix.kind());
  status.position_source = static_cast<Number>((fix.measured() ? Status::SOURCE_GPS : 0) | sensors);
  status.motion_source = static_cast<Number>(
      (fix.solved() && fix.velocity_enu_mps && fix.measured() ? Status::SOURCE_DOPPLER : 0) | sensors);
}

/// Track, speeds and their deviations. The direction of a vehicle at rest is unknown: its deviation is that
/// of an unknown direction, at most 180 deg.
template <class GPSFix>
void set_motion(GPSFix& message, const positioning::Fix& fix) {
  if (!fix.velocity_enu_mps) return;
  const Eigen::Vector3d& v = *fix.velocity_enu_mps;
  const Eigen::Vector2d along = v.head<2>();
  message.speed = along.norm();
  message.climb = v.z();
  message.track = encoding::wrapped_azimuth_deg(std::atan2(v.x(), v.y()), 3);
  if (!fix.velocity_covariance_enu || message.speed <= 0) return;
  const Eigen::Matrix2d covariance = fix.velocity_covariance_enu->topLeftCorner<2, 2>();
  const Eigen::Vector2d forward = along / message.speed;
  const Eigen::Vector2d aside(-forward.y(), forward.x());
  message.err_speed = two_sigma(forward.dot(covariance * forward));
  message.err_climb = two_sigma((*fix.velocity_covariance_enu)(2, 2));
  message.err_track =
      std::min(180.0, geodesy::degrees(two_sigma(aside.dot(covariance * aside)) / message.speed));
}

/// The attitude of a receiver, from the vehicle's sensors or from two antennas.
template <class GPSFix>
void set_attitude(GPSFix& message, const positioning::Fix& fix) {
  using Status = std::remove_reference_t<decltype(message.status)>;
  using Number = std::remove_reference_t<decltype(message.status.orientation_source)>;
  if (fix.fused()) {
    message.dip = encoding::wrapped_azimuth_deg(fix.fusion->heading_rad, 3);
    message.pitch = geodesy::degrees(fix.fusion->pitch_rad);
    message.roll = geodesy::degrees(fix.fusion->roll_rad);
    message.err_dip = 2 * geodesy::degrees(fix.fusion->heading_sigma_rad);
    message.status.orientation_source = static_cast<Number>(Status::SOURCE_GYRO | Status::SOURCE_ACCEL);
  } else if (const auto heading = encoding::heading_deg(fix, 3)) {
    message.dip = *heading;
    message.pitch = geodesy::degrees(fix.baseline->pitch_rad());
    message.err_dip = 2 * geodesy::degrees(fix.baseline->heading_sigma_rad());
    message.status.orientation_source = static_cast<Number>(Status::SOURCE_GPS);
  }
}

}  // namespace detail

/// gps_msgs/GPSFix (ROS 1: gps_common/GPSFix). Its status distinguishes differential, float and fixed
/// positions, unlike NavSatFix. `altitude` is above the ellipsoid, as in NavSatFix; `time` is GPS time,
/// seconds since 1980-01-06; `dip` is the heading from north [deg], as in drivers of receivers with two
/// antennas. Errors are 95 % values: two standard deviations, horizontal and spherical from the sum of the
/// axes' variances (2 DRMS). Values that are not known are NaN, DOPs 0. @param epoch null if the truth has
/// not come: no fix
template <class GPSFix>
[[nodiscard]] GPSFix gps_fix_message(const Head& head, const simulation::Epoch* epoch) {
  using Status = std::remove_reference_t<decltype(std::declval<GPSFix&>().status)>;
  GPSFix message;
  detail::set_header(message.header, head);
  detail::set_header(message.status.header, head);
  Status& status = message.status;
  status.status = Status::STATUS_NO_FIX;
  status.satellites_used = status.satellites_visible = 0;
  status.motion_source = status.orientation_source = status.position_source = Status::SOURCE_NONE;
  for (double* value :
       {&message.latitude,  &message.longitude, &message.altitude,  &message.track,     &message.speed,
        &message.climb,     &message.pitch,     &message.roll,      &message.dip,       &message.time,
        &message.err,       &message.err_horz,  &message.err_vert,  &message.err_track, &message.err_speed,
        &message.err_climb, &message.err_time,  &message.err_pitch, &message.err_roll,  &message.err_dip})
    *value = detail::kNaN;
  message.gdop = message.pdop = message.hdop = message.vdop = message.tdop = 0;
  std::fill(message.position_covariance.begin(), message.position_covariance.end(), detail::kNaN);
  message.position_covariance_type = GPSFix::COVARIANCE_TYPE_UNKNOWN;
  if (epoch == nullptr) return message;
  message.time = epoch->observed.time - geodesy::GpsTime();
  detail::set_gps_status(status, *epoch);
  const positioning::Fix& fix = epoch->observed.fix;
  if (!fix.solved()) return message;
  message.latitude = geodesy::degrees(fix.position.latitude_rad);
  message.longitude = geodesy::degrees(fix.position.longitude_rad);
  message.altitude = fix.position.height_m;
  if (fix.dop) {
    message.gdop = fix.dop->gdop;
    message.pdop = fix.dop->pdop;
    message.hdop = fix.dop->hdop;
    message.vdop = fix.dop->vdop;
    message.tdop = fix.dop->tdop;
  }
  const Eigen::Matrix3d& covariance = fix.covariance_enu;
  message.err = detail::two_sigma(covariance.trace());
  message.err_horz = detail::two_sigma(covariance(0, 0) + covariance(1, 1));
  message.err_vert = detail::two_sigma(covariance(2, 2));
  detail::set_position_covariance(message, fix);
  detail::set_motion(message, fix);
  detail::set_attitude(message, fix);
  return message;
}

}  // namespace canyon::ros_messages
