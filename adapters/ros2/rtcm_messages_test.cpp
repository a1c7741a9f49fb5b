#include "adapters/ros2/rtcm_messages.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <canyon_msgs/msg/gnss_satellites.hpp>
#include <chrono>
#include <functional>
#include <geometry_msgs/msg/pose_stamped.hpp>
#include <lifecycle_msgs/msg/state.hpp>
#include <rclcpp/rclcpp.hpp>
#ifdef CANYON_WITH_RTCM_MSGS
#include <rtcm_msgs/msg/message.hpp>
#endif

#include "adapters/ros2/receiver_node.hpp"

namespace canyon::adapters::ros2 {
namespace {

using canyon_msgs::msg::GnssSatellites;
using geometry_msgs::msg::PoseStamped;
using lifecycle_msgs::msg::State;

rclcpp::NodeOptions open_field(const std::string& space, const std::vector<rclcpp::Parameter>& more) {
  std::vector<rclcpp::Parameter> parameters{{"city.open", true},
                                            {"city.origin.latitude_deg", 22.3},
                                            {"city.origin.longitude_deg", 114.17},
                                            {"sky.nominal", true},
                                            {"profile", "ublox-f9p"}};
  parameters.insert(parameters.end(), more.begin(), more.end());
  return rclcpp::NodeOptions()
      .arguments({"--ros-args", "-r", "__ns:=" + space})
      .parameter_overrides(parameters);
}

rclcpp::NodeOptions rover_options() {
  return open_field("/rover", {{"pose.source", "pose"},
                               {"rtk.enabled", true},
                               {"corrections.from", "topic:/rtcm"},
                               {"corrections.max_age_s", 3.0}});
}

class Nodes : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (!rclcpp::ok()) rclcpp::init(0, nullptr);
  }

  void add(const std::shared_ptr<ReceiverNode>& node) {
    executor_.add_node(node->get_node_base_interface());
    ASSERT_EQ(node->configure().id(), State::PRIMARY_STATE_INACTIVE);
    ASSERT_EQ(node->activate().id(), State::PRIMARY_STATE_ACTIVE);
  }
  rclcpp::executors::SingleThreadedExecutor executor_;
};

#ifdef CANYON_WITH_RTCM_MSGS

using rtcm_msgs::msg::Message;

/// The rover's vehicle, and its received messages.
class Vehicle : public Nodes {
 protected:
  Vehicle() {
    executor_.add_node(node_);
    poses_ = node_->create_publisher<PoseStamped>("/rover/pose", 10);
    rtcm_ = node_->create_publisher<Message>("/rtcm", 10);
    satellites_ = node_->create_subscription<GnssSatellites>(
        "/rover/satellites", rclcpp::SensorDataQoS(),
        [this](const GnssSatellites& message) { kinds_.push_back(message.fix_kind); });
    frames_ = node_->create_subscription<Message>(
        "/rtcm", rclcpp::QoS(100), [this](const Message& message) { heard_.push_back(message); });
  }

  /// Sends poses until five successive epochs have a fix of this kind, or too much time has passed.
  [[nodiscard]] bool reaches(std::uint8_t kind) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    const auto met = [&] {
      return kinds_.size() >= 5 &&
             std::all_of(kinds_.end() - 5, kinds_.end(), [&](auto k) { return k == kind; });
    };
    while (!met() && std::chrono::steady_clock::now() < end) {
      PoseStamped pose;
      pose.header.stamp = node_->now();
      pose.pose.orientation.w = 1;
      pose.pose.position.z = 2;
      poses_->publish(pose);
      const auto next = std::chrono::steady_clock::now() + std::chrono::milliseconds(50);
      while (std::chrono::steady_clock::now() < next) executor_.spin_once(std::chrono::milliseconds(5));
    }
    return met();
  }

  rclcpp::Node::SharedPtr node_ = std::make_shared<rclcpp::Node>("vehicle");
  rclcpp::Publisher<PoseStamped>::SharedPtr poses_;
  rclcpp::Publisher<Message>::SharedPtr rtcm_;
  rclcpp::SubscriptionBase::SharedPtr satellites_, frames_;
  std::vector<std::uint8_t> kinds_;
  std::vector<Message> heard_;
};

TEST_F(Vehicle, IsFixedWhileABasePublishes) {
  const auto rover = std::make_shared<ReceiverNode>(rover_options());
  add(rover);
  ASSERT_TRUE(reaches(GnssSatellites::KIND_SINGLE));
  {
    const auto base = std::make_shared<ReceiverNode>(
        open_field("/base", {{"pose.source", "fixed"},
                             {"fixed.east_m", 900.0},
                             {"fixed.north_m", 300.0},
                             {"fixed.up_m", 5.0},
                             {"rate_hz", 1.0},
                             {"streams", std::vector<std::string>{"rtcm=topic:/rtcm"}}}));
    add(base);
    EXPECT_TRUE(reaches(GnssSatellites::KIND_FIXED));
    ASSERT_FALSE(heard_.empty());
    for (const Message& message : heard_) {
      // Preamble, 6 + 10 bits of length, the message, its checksum.
      ASSERT_GT(message.message.size(), 6U);
      EXPECT_EQ(message.message[0], 0xD3);
      EXPECT_EQ(message.message.size(), 6U + (message.message[1] << 8 | message.message[2]));
      EXPECT_EQ(message.header.frame_id, "gnss");
      EXPECT_GT(message.header.stamp.sec, 0);
    }
    EXPECT_EQ(heard_.front().message[3] << 4 | heard_.front().message[4] >> 4, 1005);
    // Bytes that are not RTCM 3 change nothing.
    for (const std::vector<std::uint8_t>& bytes :
         {std::vector<std::uint8_t>{}, std::vector<std::uint8_t>(2000, 0x55),
          std::vector<std::uint8_t>(200'000, 0xD3)}) {
      Message message;
      message.message = bytes;
      rtcm_->publish(message);
    }
    kinds_.clear();
    EXPECT_TRUE(reaches(GnssSatellites::KIND_FIXED));
    executor_.remove_node(base->get_node_base_interface());
  }
  EXPECT_TRUE(reaches(GnssSatellites::KIND_SINGLE));
  executor_.remove_node(rover->get_node_base_interface());
}

#else

TEST_F(Nodes, SayThatThisBuildHasNoRtcmMsgs) {
  const auto rover = std::make_shared<ReceiverNode>(rover_options());
  EXPECT_EQ(rover->configure().id(), State::PRIMARY_STATE_UNCONFIGURED);
}

#endif

}  // namespace
}  // namespace canyon::adapters::ros2
