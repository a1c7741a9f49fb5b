#pragma once

#include <cstdint>
#include <string>

#include "adapters/common/ros_names.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"
#include "gnss.pb.h"

namespace canyon::adapters {

/// `report` as a message; every field of `message` is written or cleared. The fields of msgs/gnss.proto say
/// units, frames and what is absent when. Paths are those of report.step->arrival, points turned by
/// world_yaw_from_enu_rad about the origin that world and ENU share.
void fill_gnss_message(const ReceiverIdentity& identity, const live::ReceiverReport& report,
                       msgs::GnssReceiver& message);

/// Writes the receiver's solution as gz-sensors' NavSat sensor writes the truth: `message` is a
/// gz.msgs.NavSat (or anything that has its functions). False, and `message` is as it was, where there is no
/// fix with a velocity, or only a prediction (FixKind::DeadReckoning): the message can say none of it, and
/// whoever reads it takes every one for a good 3D fix.
/// @param frame_id name of the frame, as gz-sensors has it: the sensor's, "iris::base_link::gps"
/// @param sequence of this sensor's messages, from 0
/// Latitude and longitude in degrees (WGS 84), altitude [m] as the world's spherical_coordinates count it
/// (the ellipsoid's, where <elevation> is), velocity [m/s] in the east-north-up of the antenna's place; the
/// stamp is simulated time.
template <typename NavSat>
[[nodiscard]] bool fill_navsat(const live::ReceiverReport& report, const std::string& frame_id,
                               std::uint64_t sequence, NavSat& message) {
  if (report.step == nullptr) return false;
  const positioning::Fix& fix = report.step->epoch.observed.fix;
  if (!fix.measured() || !fix.velocity_enu_mps) return false;
  constexpr std::int64_t kNanoseconds = 1'000'000'000;
  message.Clear();
  auto* header = message.mutable_header();
  header->mutable_stamp()->set_sec(report.sim_time_ns / kNanoseconds);
  header->mutable_stamp()->set_nsec(static_cast<std::int32_t>(report.sim_time_ns % kNanoseconds));
  auto* counted = header->add_data();
  counted->set_key("seq");
  counted->add_value(std::to_string(sequence));
  message.set_frame_id(frame_id);
  message.set_latitude_deg(geodesy::degrees(fix.position.latitude_rad));
  message.set_longitude_deg(geodesy::degrees(fix.position.longitude_rad));
  message.set_altitude(fix.position.height_m);
  message.set_velocity_east(fix.velocity_enu_mps->x());
  message.set_velocity_north(fix.velocity_enu_mps->y());
  message.set_velocity_up(fix.velocity_enu_mps->z());
  return true;
}

}  // namespace canyon::adapters
