#include "adapters/ros2/receiver_topics.hpp"

#include <memory>
#include <utility>

namespace canyon::adapters::ros2 {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

}  // namespace

template <class Message>
ReceiverTopics::Topic<Message> ReceiverTopics::advertise(const std::string& name, const rclcpp::QoS& qos) {
  rclcpp::PublisherOptions options;
  options.qos_overriding_options = rclcpp::QosOverridingOptions::with_default_policies();
  const std::string resolved = node_.get_node_topics_interface()->resolve_topic_name(name);
  options.event_callbacks.incompatible_qos_callback = [logger = node_.get_logger(), resolved](
                                                          rclcpp::QOSOfferedIncompatibleQoSInfo& info) {
    RCLCPP_WARN(logger,
                "a subscriber of %s asks for a quality of service that is not offered (%s) and gets nothing; "
                "let it ask for that of sensor data, or set qos_overrides.%s.publisher.*",
                resolved.c_str(), rclcpp::qos_policy_name_from_kind(info.last_policy_kind).c_str(),
                resolved.c_str());
  };
  return node_.create_publisher<Message>(name, qos, options);
}

ReceiverTopics::ReceiverTopics(rclcpp_lifecycle::LifecycleNode& node, bool clock) : node_(node) {
  const rclcpp::SensorDataQoS sensor;
  const rclcpp::QoS reliable(10);
  fix_ = advertise<sensor_msgs::msg::NavSatFix>("fix", sensor);
  fix_velocity_ = advertise<geometry_msgs::msg::TwistWithCovarianceStamped>("fix_velocity", sensor);
  gnss_multipath_ = advertise<canyon_msgs::msg::GnssMultipath>("gnss_multipath", sensor);
  satellites_ = advertise<canyon_msgs::msg::GnssSatellites>("satellites", sensor);
  raw_observations_ = advertise<canyon_msgs::msg::GnssRawObservations>("raw_observations", sensor);
  diagnostics_ = advertise<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics", reliable);
  if (clock) clock_ = advertise<rosgraph_msgs::msg::Clock>("/clock", reliable);
}

template <class Message, class Make>
void ReceiverTopics::send(const Topic<Message>& topic, const Make& make) {
  if (topic->is_activated() && topic->get_subscription_count() > 0) {
    topic->publish(std::make_unique<Message>(make()));  // handed over as it is within a process
  }
}

void ReceiverTopics::publish(const simulation::LiveReceiver::Step* step, std::int64_t stamp_ns,
                             const std::string& frame_id, const ros_messages::ReceiverHealth& health) {
  using namespace ros_messages;
  const Head head{
      {static_cast<std::int32_t>(stamp_ns / kSecond_ns), static_cast<std::uint32_t>(stamp_ns % kSecond_ns)},
      frame_id};
  const simulation::Epoch* epoch = step != nullptr ? &step->epoch : nullptr;
  if (!health.finished) {
    send(fix_, [&] { return fix_message<sensor_msgs::msg::NavSatFix>(head, epoch); });
    send(fix_velocity_,
         [&] { return velocity_message<geometry_msgs::msg::TwistWithCovarianceStamped>(head, epoch); });
    send(gnss_multipath_, [&] { return multipath_message<canyon_msgs::msg::GnssMultipath>(head, epoch); });
    send(satellites_, [&] { return satellites_message<canyon_msgs::msg::GnssSatellites>(head, epoch); });
    // Phases are followed whether somebody listens or not.
    auto raw = std::make_unique<canyon_msgs::msg::GnssRawObservations>(
        raw_.message<canyon_msgs::msg::GnssRawObservations>(head, epoch));
    if (raw_observations_->is_activated()) raw_observations_->publish(std::move(raw));
  }
  // Once a second, and where something has changed.
  const int state = health.finished ? 3 : epoch == nullptr ? 2 : epoch->observed.fix.solved() ? 1 : 0;
  if (state != diagnosed_state_ || stamp_ns < diagnosed_ns_ || stamp_ns - diagnosed_ns_ >= kSecond_ns) {
    diagnosed_state_ = state;
    diagnosed_ns_ = stamp_ns;
    send(diagnostics_,
         [&] { return diagnostics_message<diagnostic_msgs::msg::DiagnosticArray>(head, health, epoch); });
  }
}

void ReceiverTopics::publish_clock(std::int64_t now_ns) {
  rosgraph_msgs::msg::Clock message;
  message.clock = rclcpp::Time(now_ns);
  clock_->publish(message);
}

void ReceiverTopics::reset() {
  raw_.reset();
  diagnosed_ns_ = -1;
  diagnosed_state_ = -1;
}

}  // namespace canyon::adapters::ros2
