#pragma once

#include <rclcpp/create_publisher.hpp>
#include <string>

#include "adapters/ros2/receiver_topics.hpp"

namespace canyon::adapters::ros2 {

/// Makes a publisher whose quality of service people can override by parameters. A subscriber that asks for
/// more than is offered is named in the log. An empty name is not published.
template <class Publisher>
void advertise(NodeParts& node, const std::string& name, const rclcpp::QoS& qos, Publisher& publisher) {
  using Message = typename Publisher::element_type::PublishedType;
  if (name.empty()) return;
  rclcpp::PublisherOptions options;
  options.qos_overriding_options = rclcpp::QosOverridingOptions::with_default_policies();
  const std::string resolved = node.topics->resolve_topic_name(name);
  options.event_callbacks.incompatible_qos_callback = [logger = node.logger, resolved](
                                                          rclcpp::QOSOfferedIncompatibleQoSInfo& info) {
    RCLCPP_WARN(logger,
                "a subscriber of %s asks for a quality of service that is not offered (%s) and gets nothing; "
                "let it ask for that of sensor data, or set qos_overrides.%s.publisher.*",
                resolved.c_str(), rclcpp::qos_policy_name_from_kind(info.last_policy_kind).c_str(),
                resolved.c_str());
  };
  publisher = rclcpp::create_publisher<Message>(node.parameters, node.topics, name, qos, options);
}

}  // namespace canyon::adapters::ros2
