#include "adapters/ros2/host_publisher.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <canyon_msgs/msg/gnss_raw_observations.hpp>
#include <chrono>
#include <diagnostic_msgs/msg/diagnostic_array.hpp>
#include <rclcpp/rclcpp.hpp>
#include <sensor_msgs/msg/laser_scan.hpp>
#include <sensor_msgs/msg/nav_sat_fix.hpp>

#include "canyon/base/input_error.hpp"
#include "tests/support/sample_signals.hpp"

namespace canyon::adapters::ros2 {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

ReceiverIdentity iris(const std::string& sensor = "gps") {
  return {"city", "iris", "iris::link", "iris", sensor, "gnss"};
}

/// Subscribes with its own node in this process.
class Listener {
 public:
  template <class Message>
  std::shared_ptr<std::vector<Message>> listen(const std::string& topic) {
    auto inbox = std::make_shared<std::vector<Message>>();
    subscriptions_.push_back(node_->create_subscription<Message>(
        topic, rclcpp::SensorDataQoS(), [inbox](const Message& message) { inbox->push_back(message); }));
    return inbox;
  }
  template <class TriangleHit>
  void until(const TriangleHit& met, const std::function<void()>& work) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!met()) {
      ASSERT_LT(std::chrono::steady_clock::now(), end);
      work();
      rclcpp::spin_some(node_);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

 private:
  rclcpp::Node::SharedPtr node_ = std::make_shared<rclcpp::Node>("listener");
  std::vector<rclcpp::SubscriptionBase::SharedPtr> subscriptions_;
};

TEST(HostPublisher, BeginsRosAndPublishes) {
  RosSettings settings;
  settings.frame_id = "antenna";
  settings.publish_scan = true;
  settings.remappings = {{"fix", "gps/fix"}, {"~/out", "ranges"}};
  const auto publisher = make_host_publisher(iris(), settings, {});
  ASSERT_TRUE(rclcpp::ok());
  Listener listener;
  const auto fixes = listener.listen<sensor_msgs::msg::NavSatFix>("/iris/gps/fix");
  const auto scans = listener.listen<sensor_msgs::msg::LaserScan>("/iris/ranges");
  const auto raw = listener.listen<canyon_msgs::msg::GnssRawObservations>("/iris/raw_observations");
  const auto reports = listener.listen<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics");

  simulation::ReceiverRunner::Step step{test::sample_signal_epoch(test::sample_time(), test::sample_time()),
                                        {}};
  live::ReceiverReport report;
  report.step = &step;
  report.scan_ranges_m = {3, 4};
  report.scan_max_range_m = 100;
  report.sim_time_ns = 12'300'000'000;
  listener.until([&] { return !fixes->empty() && !scans->empty() && !raw->empty() && !reports->empty(); },
                 [&] {
                   report.sim_time_ns += 1'000'000'000;
                   publisher->publish(report);
                 });
  const auto& fix = fixes->back();
  EXPECT_EQ(fix.header.frame_id, "antenna");
  EXPECT_EQ(fix.header.stamp.nanosec, 300'000'000U);
  EXPECT_THAT(scans->back().ranges, ElementsAre(3, 4));
  EXPECT_EQ(raw->back().observations.size(), 10U);  // as in raw_conversions_test.cpp
  EXPECT_EQ(reports->back().status.at(0).name, "/iris/gnss: receiver");

  // No truth: no position, with the reason.
  fixes->clear();
  reports->clear();
  report.step = nullptr;
  report.reason = "pose_topic is silent";
  listener.until([&] { return !fixes->empty() && !reports->empty() && reports->back().status[0].level == 2; },
                 [&] {
                   report.sim_time_ns += 1'000'000'000;
                   publisher->publish(report);
                 });
  EXPECT_EQ(fixes->back().status.status, -1);
  EXPECT_EQ(reports->back().status[0].message, "pose_topic is silent");
}

TEST(HostPublisher, ReceiversHaveTopicsOfTheirOwn) {
  const auto first = make_host_publisher(iris("gps"), {}, {});
  EXPECT_THAT(first->take_notes(), IsEmpty());
  const auto second = make_host_publisher(iris("gps1"), {}, {});
  EXPECT_THAT(second->take_notes(),
              ElementsAre("another receiver uses the ROS name /iris/fix; names of this one are in "
                          "/iris/link/gps1"));
  RosSettings requested;
  requested.ros_namespace = "/iris";
  try {
    (void)make_host_publisher(iris("gps2"), requested, {});
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("a different <ros><namespace>"));
  }
}

}  // namespace
}  // namespace canyon::adapters::ros2
