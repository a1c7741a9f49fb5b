#pragma once

#include <canyon_msgs/msg/gnss_multipath.hpp>
#include <canyon_msgs/msg/gnss_raw_observations.hpp>
#include <canyon_msgs/msg/gnss_satellites.hpp>
#include <diagnostic_msgs/msg/diagnostic_array.hpp>
#include <geometry_msgs/msg/twist_with_covariance_stamped.hpp>
#include <rclcpp_lifecycle/lifecycle_node.hpp>
#include <rclcpp_lifecycle/lifecycle_publisher.hpp>
#include <rosgraph_msgs/msg/clock.hpp>
#include <sensor_msgs/msg/nav_sat_fix.hpp>
#include <string>

#include "adapters/ros/raw_conversions.hpp"
#include "canyon/simulation/live_receiver.hpp"

namespace canyon::adapters::ros2 {

/// A receiver's topics, with the quality of service of sensor data; diagnostics and clock are reliable. A
/// subscriber that asks for more than is offered is told of in the log. Only what somebody listens to is
/// made.
class ReceiverTopics {
 public:
  ReceiverTopics(rclcpp_lifecycle::LifecycleNode& node, bool clock);

  /// @param step null where there is no epoch: health.reason says why
  void publish(const simulation::LiveReceiver::Step* step, std::int64_t stamp_ns, const std::string& frame_id,
               const ros_messages::ReceiverHealth& health);
  void publish_clock(std::int64_t now_ns);
  /// The drive begins anew.
  void reset();

 private:
  template <class Message>
  using Topic = typename rclcpp_lifecycle::LifecyclePublisher<Message>::SharedPtr;
  template <class Message>
  Topic<Message> advertise(const std::string& name, const rclcpp::QoS& qos);
  template <class Message, class Make>
  void send(const Topic<Message>& topic, const Make& make);

  rclcpp_lifecycle::LifecycleNode& node_;
  Topic<sensor_msgs::msg::NavSatFix> fix_;
  Topic<geometry_msgs::msg::TwistWithCovarianceStamped> fix_velocity_;
  Topic<canyon_msgs::msg::GnssMultipath> gnss_multipath_;
  Topic<canyon_msgs::msg::GnssSatellites> satellites_;
  Topic<canyon_msgs::msg::GnssRawObservations> raw_observations_;
  Topic<diagnostic_msgs::msg::DiagnosticArray> diagnostics_;
  Topic<rosgraph_msgs::msg::Clock> clock_;
  ros_messages::RawObservations raw_;
  std::int64_t diagnosed_ns_ = -1;
  int diagnosed_state_ = -1;
};

}  // namespace canyon::adapters::ros2
