#include "adapters/ros2/rtcm_messages.hpp"

#include <utility>

#include "canyon/base/input_error.hpp"
#ifdef CANYON_WITH_RTCM_MSGS
#include <rclcpp/create_subscription.hpp>
#include <rtcm_msgs/msg/message.hpp>

#include "adapters/ros2/rtcm_topic.hpp"
#endif

namespace canyon::adapters::ros2 {

#ifdef CANYON_WITH_RTCM_MSGS

namespace {

using Message = rtcm_msgs::msg::Message;

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::size_t kDepth = 100;

class RtcmPublisher final : public transport::Transport {
 public:
  RtcmPublisher(NodeParts node, const std::string& topic, std::string frame_id,
                std::function<std::int64_t()> stamp_ns)
      : frame_id_(std::move(frame_id)), stamp_ns_(std::move(stamp_ns)) {
    advertise(node, topic, rclcpp::QoS(kDepth), publisher_);
  }

  void send(std::string_view bytes) override {
    for (const std::string_view frame : split_frames(bytes)) {
      auto message = std::make_unique<Message>();
      const std::int64_t stamp_ns = stamp_ns_();
      message->header.stamp.sec = static_cast<std::int32_t>(stamp_ns / kSecond_ns);
      message->header.stamp.nanosec = static_cast<std::uint32_t>(stamp_ns % kSecond_ns);
      message->header.frame_id = frame_id_;
      message->message.assign(frame.begin(), frame.end());
      publisher_->publish(std::move(message));
    }
  }
  void finish(const std::optional<transport::Correction>& /*correction*/) override {}

 private:
  std::string frame_id_;
  std::function<std::int64_t()> stamp_ns_;
  rclcpp::Publisher<Message>::SharedPtr publisher_;
};

}  // namespace

void require_rtcm_msgs(const std::string& /*setting*/) {}

std::shared_ptr<transport::Link> open_rtcm_topic(NodeParts node, const std::string& topic,
                                                 const std::string& frame_id,
                                                 std::function<std::int64_t()> stamp_ns) {
  return std::make_shared<transport::Link>(
      std::make_unique<RtcmPublisher>(std::move(node), topic, frame_id, std::move(stamp_ns)));
}

rclcpp::SubscriptionBase::SharedPtr subscribe_to_rtcm(NodeParts node, const std::string& topic,
                                                      std::function<void(std::string_view)> receive) {
  const std::string resolved = node.topics->resolve_topic_name(topic);
  rclcpp::SubscriptionOptions options;
  options.qos_overriding_options = rclcpp::QosOverridingOptions::with_default_policies();
  options.event_callbacks.incompatible_qos_callback = [logger = node.logger, resolved](
                                                          rclcpp::QOSRequestedIncompatibleQoSInfo& info) {
    RCLCPP_WARN(
        logger,
        "a publisher of %s does not offer the requested quality of service (%s), so nothing is received "
        "from it; set qos_overrides.%s.subscription.*",
        resolved.c_str(), rclcpp::qos_policy_name_from_kind(info.last_policy_kind).c_str(), resolved.c_str());
  };
  return rclcpp::create_subscription<Message>(
      node.parameters, node.topics, topic, rclcpp::QoS(kDepth),
      [receive = std::move(receive)](const Message& message) {
        // uint8 here, char there. NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast)
        receive({reinterpret_cast<const char*>(message.message.data()), message.message.size()});
      },
      options);
}

#else

void require_rtcm_msgs(const std::string& setting) {
  throw InputError(setting + ": this build of Canyon has no rtcm_msgs",
                   "install the package rtcm_msgs of your ROS 2, and build Canyon again");
}

std::shared_ptr<transport::Link> open_rtcm_topic(NodeParts /*node*/, const std::string& topic,
                                                 const std::string& /*frame_id*/,
                                                 std::function<std::int64_t()> /*stamp_ns*/) {
  require_rtcm_msgs("topic " + topic);
  return nullptr;
}

rclcpp::SubscriptionBase::SharedPtr subscribe_to_rtcm(NodeParts /*node*/, const std::string& topic,
                                                      std::function<void(std::string_view)> /*receive*/) {
  require_rtcm_msgs("topic " + topic);
  return nullptr;
}

#endif

}  // namespace canyon::adapters::ros2
