#include <gtest/gtest.h>

#include "adapters/gazebo_classic/testing/in_process_server.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

constexpr const char* kEmpty = R"(<?xml version="1.0"?><sdf version="1.6"><world name="w">
<physics type="ode"><max_step_size>0.01</max_step_size><real_time_update_rate>0</real_time_update_rate></physics>
</world></sdf>)";

TEST(InProcessServer, StepsExactly) {
  auto& server = test::InProcessServer::get();
  const auto world = server.load(kEmpty);
  server.step(7);
  EXPECT_DOUBLE_EQ(world->SimTime().Double(), 0.07);
}

TEST(InProcessServer, LoadsAnotherWorld) {
  auto& server = test::InProcessServer::get();
  const auto world = server.load(kEmpty);
  EXPECT_EQ(world->SimTime().Double(), 0);
  server.step(1);
  EXPECT_DOUBLE_EQ(world->SimTime().Double(), 0.01);
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
