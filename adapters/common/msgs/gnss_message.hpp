#pragma once

#include <cstdint>
#include <string>

#include "adapters/common/ros_names.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"
#include "gnss.pb.h"

namespace canyon::adapters {

/// `report` as a message; every field of `message` is written or cleared. msgs/gnss.proto documents units,
/// frames and conditions for absent fields. Paths are those of report.step->arrival; points are rotated by
/// world_yaw_from_enu_rad about the common origin of world and ENU.
void fill_gnss_message(const ReceiverIdentity& identity, const live::ReceiverReport& report,
                       msgs::GnssReceiver& message);

/// Writes the receiver's solution in the format in which gz-sensors' NavSat sensor writes the truth:
/// `message` is a gz.msgs.NavSat (or a type with its functions). False, with `message` unchanged, if there is
/// no fix with a velocity, or only a prediction (FixKind::DeadReckoning): the message cannot express this,
/// and readers treat every message as a good 3D fix. Latitude and longitude are in degrees (WGS 84), altitude
/// [m] as in the world's spherical_coordinates (ellipsoidal, like <elevation>), velocity [m/s] in
/// east-north-up at the antenna. The stamp is simulated time.
/// @param frame_id name of the frame, as in gz-sensors: the sensor's, "iris::base_link::gps"
/// @param sequence of this sensor's messages, from 0
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
