#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <rclcpp/subscription_base.hpp>
#include <string>
#include <string_view>

#include "adapters/ros2/receiver_topics.hpp"
#include "canyon/base/transport/link.hpp"

namespace canyon::adapters::ros2 {

// RTCM 3 as rtcm_msgs/Message, as published and read by NTRIP clients and receiver drivers. Both ends are
// reliable and queue 100 messages: an epoch has up to some 40 frames. A build without the package rtcm_msgs
// throws InputError.

/// Throws InputError if this build has no rtcm_msgs. @param setting that requires it, for the message
void require_rtcm_msgs(const std::string& setting);

/// Publishes complete RTCM 3 frames sent to the link, one message per frame.
/// @param stamp_ns of the messages
[[nodiscard]] std::shared_ptr<transport::Link> open_rtcm_topic(NodeParts node, const std::string& topic,
                                                               const std::string& frame_id,
                                                               std::function<std::int64_t()> stamp_ns);

/// Passes on the bytes of each message.
[[nodiscard]] rclcpp::SubscriptionBase::SharedPtr subscribe_to_rtcm(
    NodeParts node, const std::string& topic, std::function<void(std::string_view)> receive);

}  // namespace canyon::adapters::ros2
