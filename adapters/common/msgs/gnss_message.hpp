#pragma once

#include "adapters/common/ros_names.hpp"
#include "canyon/live/epoch_publisher.hpp"
#include "gnss.pb.h"

namespace canyon::adapters {

/// `report` as a message; every field of `message` is written or cleared. The fields of msgs/gnss.proto say
/// units, frames and what is absent when. Paths are those of report.step->arrival, points turned by
/// world_yaw_from_enu_rad about the origin that world and ENU share.
void fill_gnss_message(const ReceiverIdentity& identity, const live::ReceiverReport& report,
                       msgs::GnssReceiver& message);

}  // namespace canyon::adapters
