#include "adapters/gazebo_classic/ros_pose.hpp"

#include <gtest/gtest.h>

#include <mutex>
#include <optional>

#include "adapters/gazebo_classic/testing/ros_core.hpp"
#include "tests/support/program.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using test::ChildProgram;
using test::eventually;
using test::RosCore;
using test::RosEnvironment;
using namespace std::chrono_literals;

/// The last received pose, and the number of poses.
struct Inbox {
  std::mutex mutex;
  std::optional<simulation::RigidPose> pose;
  double stamp_s = -1;
  int count = 0;

  [[nodiscard]] std::shared_ptr<void> subscribe(const std::string& topic) {
    return subscribe_ros_pose(topic, [this](const simulation::RigidPose& p, double stamp) {
      const std::lock_guard lock(mutex);
      pose = p;
      stamp_s = stamp;
      ++count;
    });
  }
  [[nodiscard]] int received() {
    const std::lock_guard lock(mutex);
    return count;
  }
};

/// rostopic pub of one pose, at 50 Hz.
ChildProgram publish_pose(const std::string& topic) {
  return ChildProgram(
      {"rostopic", "pub", "-r", "50", topic, "geometry_msgs/PoseStamped",
       "{header: {stamp: {secs: 1234, nsecs: 500000000}, frame_id: world}, pose: {position: {x: "
       "1.5, y: -2.5, z: 3.25}, orientation: {x: 0.5, y: -0.5, z: 0.5, w: -0.5}}}"},
      RosEnvironment::get().folder() / "pub.log");
}

class RosPose : public testing::Test {
 protected:
  void SetUp() override {
    CANYON_NEEDS_PROGRAM("roscore");
    RosEnvironment::get();
  }
};

TEST_F(RosPose, HandsOnPoseAndStamp) {
  const RosCore core;
  Inbox inbox;
  const auto subscription = inbox.subscribe("/mocap/rover/pose");
  const ChildProgram publisher = publish_pose("/mocap/rover/pose");
  ASSERT_TRUE(eventually([&] { return inbox.received() >= 3; }));
  const std::lock_guard lock(inbox.mutex);
  EXPECT_EQ(inbox.pose->position_m, Eigen::Vector3d(1.5, -2.5, 3.25));
  EXPECT_EQ(inbox.pose->attitude.w(), -0.5);
  EXPECT_EQ(inbox.pose->attitude.x(), 0.5);
  EXPECT_EQ(inbox.pose->attitude.y(), -0.5);
  EXPECT_EQ(inbox.pose->attitude.z(), 0.5);
  EXPECT_EQ(inbox.stamp_s, 1234.5);
}

TEST_F(RosPose, ComesWithMastersThatComeLater) {
  Inbox inbox;
  const auto subscription = inbox.subscribe("pose");  // relative: in the node's namespace, which is "/"
  for (int master = 0; master < 2; ++master) {
    const RosCore core;
    const ChildProgram publisher = publish_pose("/pose");
    const int before = inbox.received();
    EXPECT_TRUE(eventually([&] { return inbox.received() > before; })) << master;
  }
}

TEST_F(RosPose, IsSilentOnceDropped) {
  const RosCore core;
  Inbox inbox, other;
  auto subscription = inbox.subscribe("/pose");
  const auto stays = other.subscribe("/pose");
  const ChildProgram publisher = publish_pose("/pose");
  ASSERT_TRUE(eventually([&] { return inbox.received() > 0 && other.received() > 0; }));
  subscription.reset();
  const int last = inbox.received();
  const int others = other.received();
  EXPECT_TRUE(eventually([&] { return other.received() > others + 10; }));
  EXPECT_EQ(inbox.received(), last);
}

TEST_F(RosPose, WithoutMasterOrNameNothingComesAndNothingWaits) {
  Inbox inbox;
  const auto begin = std::chrono::steady_clock::now();
  { const auto subscription = inbox.subscribe("/pose"); }
  EXPECT_EQ(inbox.subscribe("no name"), nullptr);
  EXPECT_EQ(inbox.subscribe(""), nullptr);
  EXPECT_EQ(inbox.subscribe("~/pose"), nullptr);  // Gazebo's
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 1500ms);
  EXPECT_EQ(inbox.received(), 0);
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
