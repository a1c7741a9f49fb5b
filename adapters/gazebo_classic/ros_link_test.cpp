#include "adapters/gazebo_classic/ros_link.hpp"

#include <gtest/gtest.h>
#include <ros/init.h>
#include <ros/master.h>
#include <ros/this_node.h>

#include <atomic>
#include <cstdlib>

#include "adapters/gazebo_classic/testing/ros_core.hpp"
#include "canyon/base/input_error.hpp"
#include "tests/support/program.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using test::eventually;

struct CountingClient final : RosClient {
  bool connect(ros::NodeHandle&) override {
    ++connects;
    return connects > refusals;
  }
  void disconnect() override { ++disconnects; }
  int refusals = 0;
  std::atomic<int> connects{0}, disconnects{0};
};

// The tests run in this order, as roscpp is set up once in a process.
TEST(RosLink, RefusesAnAddressThatIsNone) {
  setenv("ROS_MASTER_URI", "localhost:11311", 1);
  EXPECT_THROW((void)RosLink::get(), InputError);
  EXPECT_FALSE(ros::isInitialized());
}

TEST(RosLink, IsOneForAllAndBeginsAgain) {
  test::RosEnvironment::get();
  std::weak_ptr<RosLink> first;
  {
    const auto link = RosLink::get();
    EXPECT_EQ(link, RosLink::get());
    first = link;
  }
  EXPECT_TRUE(first.expired());
  EXPECT_EQ(ros::this_node::getName().rfind("/gazebo_canyon_", 0), 0U);
  EXPECT_NE(RosLink::get(), nullptr);
}

TEST(RosLink, ClaimsAllTopicsOrNone) {
  test::RosEnvironment::get();
  const auto link = RosLink::get();
  EXPECT_EQ(link->claim({"/a", "/b"}), "");
  EXPECT_EQ(link->claim({"/c", "/b"}), "/b");
  EXPECT_EQ(link->claim({"/c"}), "");
  link->release({"/a", "/b"});
  EXPECT_EQ(link->claim({"/b"}), "");
}

TEST(RosLink, ConnectsOncePerMasterAndDisconnects) {
  CANYON_NEEDS_PROGRAM("roscore");
  test::RosEnvironment::get();
  const auto link = RosLink::get();
  const auto client = std::make_shared<CountingClient>();
  const auto reluctant = std::make_shared<CountingClient>();
  reluctant->refusals = 1;
  const auto never = std::make_shared<CountingClient>();
  link->add(client);
  link->add(reluctant);
  link->add(never);
  link->remove(never);
  EXPECT_TRUE(eventually([&] { return never->disconnects == 1; }));
  EXPECT_EQ(client->connects, 0);
  {
    const test::RosCore core;
    EXPECT_TRUE(eventually([&] { return client->connects == 1 && reluctant->connects == 2; }));
  }
  {
    const test::RosCore core;
    EXPECT_TRUE(eventually([&] { return client->connects >= 2; }));
  }
  link->remove(client);
  EXPECT_TRUE(eventually([&] { return client->disconnects == client->connects; }));
  EXPECT_EQ(never->connects, 0);
}

TEST(RosLink, DisconnectsEverybodyWhenItEnds) {
  CANYON_NEEDS_PROGRAM("roscore");
  test::RosEnvironment::get();
  const test::RosCore core;
  auto link = RosLink::get();
  const auto client = std::make_shared<CountingClient>();
  link->add(client);
  ASSERT_TRUE(eventually([&] { return client->connects == 1; }));
  EXPECT_TRUE(ros::ok());
  link.reset();
  EXPECT_EQ(client->disconnects, 1);
  EXPECT_FALSE(ros::ok());
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
