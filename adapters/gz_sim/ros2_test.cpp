// The system publishes on ROS 2 from the server's own process.
#include <gtest/gtest.h>

#include <canyon_msgs/srv/fault_command.hpp>
#include <cmath>
#include <rclcpp/rclcpp.hpp>
#include <sensor_msgs/msg/nav_sat_fix.hpp>

#include "adapters/gz_sim/testing/sim_server.hpp"
#include "adapters/gz_sim/testing/street_world.hpp"

namespace canyon::adapters::gz_sim {
namespace {

using sensor_msgs::msg::NavSatFix;

TEST(Ros2, HasCovarianceAndStatus) {
  const std::string sensor =
      "<sensor name='antenna' type='navsat'><pose>0 0 2 0 0 0</pose><update_rate>10</update_rate><canyon>"
      "<sky><nominal>true</nominal><systems>GPS</systems></sky><start>2026-06-01T08:00:00Z</start>"
      "<profile>ideal</profile></canyon></sensor>";
  test::SimServer server(test::street_world(test::street_car(sensor), 0, false));
  server.step(1);  // ROS 2 begins with the receiver
  const auto node = std::make_shared<rclcpp::Node>("listener");
  std::vector<NavSatFix> fixes;
  const auto subscription = node->create_subscription<NavSatFix>(
      "/car/fix", rclcpp::SensorDataQoS(), [&](const NavSatFix& message) { fixes.push_back(message); });
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (fixes.size() < 3 && std::chrono::steady_clock::now() < deadline) {
    server.step(10);
    rclcpp::spin_some(node);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  ASSERT_GE(fixes.size(), 3U);
  const NavSatFix& fix = fixes.back();
  EXPECT_EQ(fix.status.status, sensor_msgs::msg::NavSatStatus::STATUS_FIX);
  EXPECT_EQ(fix.position_covariance_type, NavSatFix::COVARIANCE_TYPE_KNOWN);
  EXPECT_GT(fix.position_covariance[0], 0);
  EXPECT_NEAR(fix.latitude, 22.3, 1e-7) << "an ideal receiver in the open: where the car stands";
  EXPECT_NEAR(fix.altitude, 7, 1e-3);
  // Simulated time, a tenth of a second apart.
  const auto stamp_s = [](const NavSatFix& message) {
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec;
  };
  EXPECT_LT(stamp_s(fix), 1000);
  EXPECT_NEAR(std::fmod(stamp_s(fix) + 0.05, 0.1), 0.05, 1e-6);
}

// The services of two receivers of one world: a fault applies to the requested one.
TEST(Ros2, FaultsComeAndGoByServices) {
  using canyon_msgs::srv::FaultCommand;
  const std::string ros = "<ros><namespace>/NAME</namespace><changes>CHANGES</changes></ros>";
  const auto sensor = [&ros](const std::string& name, const std::string& changes) {
    std::string own = ros;
    own.replace(own.find("NAME"), 4, name).replace(own.find("CHANGES"), 7, changes);
    return "<sensor name='" + name + "' type='navsat'><update_rate>10</update_rate><canyon>" + own +
           "<sky><nominal>true</nominal><systems>GPS</systems></sky><start>2026-06-01T08:00:00Z</start>"
           "<profile>ideal</profile></canyon></sensor>";
  };
  test::SimServer server(
      test::street_world(test::street_car(sensor("front", "true") + sensor("rear", "false")), 0, false));
  server.step(1);
  const auto node = std::make_shared<rclcpp::Node>("caller");
  const auto query = [&](const std::string& service, const std::string& text) {
    const auto client = node->create_client<FaultCommand>(service);
    EXPECT_TRUE(client->wait_for_service(std::chrono::seconds(20))) << service;
    const auto request = std::make_shared<FaultCommand::Request>();
    request->fault = text;
    auto reply = client->async_send_request(request);
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (std::chrono::steady_clock::now() < deadline) {
      server.step(1);
      if (rclcpp::spin_until_future_complete(node, reply, std::chrono::milliseconds(10)) ==
          rclcpp::FutureReturnCode::SUCCESS) {
        return *reply.get();
      }
    }
    ADD_FAILURE() << service << " does not answer";
    return FaultCommand::Response();
  };
  EXPECT_EQ(query("/front/canyon/get_faults", "").message, "none");
  const auto added = query("/front/canyon/add_fault", "{name: dark, from_s: 0, outage: {}}");
  EXPECT_TRUE(added.success);
  EXPECT_EQ(added.message, "added car::body::front: dark");
  EXPECT_EQ(query("/front/canyon/get_faults", "").message,
            "car::body::front: dark (outage) from 0 s, at work");
  EXPECT_EQ(query("/rear/canyon/get_faults", "").message, "none");
  const auto refused = query("/rear/canyon/add_fault", "{outage: {}}");
  EXPECT_FALSE(refused.success);
  EXPECT_NE(refused.message.find("<changes>"), std::string::npos) << refused.message;
  EXPECT_TRUE(query("/front/canyon/end_fault", "dark").success);
}

}  // namespace
}  // namespace canyon::adapters::gz_sim
