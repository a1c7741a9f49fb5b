#include <gtest/gtest.h>
#include <ros/init.h>
#include <ros/node_handle.h>
#include <ros/this_node.h>

#include "adapters/common/testing/sample_report.hpp"
#include "adapters/gazebo_classic/publishers.hpp"
#include "adapters/gazebo_classic/testing/ros_core.hpp"
#include "tests/support/program.hpp"

// A process in which ROS is already set up, as by gazebo_ros.

namespace canyon::adapters::gazebo_classic {
namespace {

using canyon::test::run_program;
using test::eventually;

TEST(RosSharedNode, IsUsedAndLeftRunning) {
  CANYON_NEEDS_PROGRAM("roscore");
  test::RosEnvironment::get();
  const test::RosCore core;
  ros::init(ros::M_string{}, "gazebo", ros::init_options::NoSigintHandler);
  ros::NodeHandle theirs;
  auto publisher = make_ros_publisher(canyon::test::sample_identity(), {}, {});
  EXPECT_TRUE(eventually([] {
    return run_program("rostopic info /iris/fix 2>&1").output.find(" * /gazebo (") != std::string::npos;
  }));
  publisher.reset();
  EXPECT_TRUE(ros::ok());
  EXPECT_TRUE(eventually(
      [] { return run_program("rostopic list 2>&1").output.find("/iris/fix\n") == std::string::npos; }));
  EXPECT_EQ(query_master(test::RosEnvironment::get().master(), "/gazebo", std::chrono::seconds(5)),
            MasterReply::Registered);
}

TEST(RosSharedNode, MayEndFirst) {
  CANYON_NEEDS_PROGRAM("roscore");
  test::RosEnvironment::get();
  const test::RosCore core;
  ros::init(ros::M_string{}, "gazebo", ros::init_options::NoSigintHandler);
  auto theirs = std::make_unique<ros::NodeHandle>();
  auto publisher = make_ros_publisher(canyon::test::sample_identity(), {}, {});
  EXPECT_TRUE(eventually(
      [] { return run_program("rostopic list 2>&1").output.find("/iris/fix\n") != std::string::npos; }));
  ros::shutdown();
  const canyon::test::SampleReport sample;
  for (int i = 0; i < 100; ++i) publisher->publish(sample.report);
  const auto begin = std::chrono::steady_clock::now();
  publisher.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(1900));
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
