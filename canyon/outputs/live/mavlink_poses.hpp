#pragma once

#include <memory>
#include <string>
#include <vector>

#include "canyon/outputs/live/pose_decoder.hpp"

namespace canyon::live {

/// Poses in MAVLink messages, whose frames are defined by the message. PoseReport::id is the system ID.
/// @param messages names of messages to use; empty: SIM_STATE, HIL_STATE_QUATERNION, ATT_POS_MOCAP,
/// VISION_POSITION_ESTIMATE and ODOMETRY, which carry the truth of a simulator or motion capture. Estimates
/// of an autopilot: LOCAL_POSITION_NED, GLOBAL_POSITION_INT. Throws InputError for unknown ones.
[[nodiscard]] std::unique_ptr<PoseDecoder> make_mavlink_poses(const std::vector<std::string>& messages);

}  // namespace canyon::live
