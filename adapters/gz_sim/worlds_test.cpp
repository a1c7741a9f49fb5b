// The worlds that come with the system: they load unchanged, and their cars drive.
#include <gtest/gtest.h>

#include <gz/msgs/twist.pb.h>

#include <thread>

#include "adapters/gz_sim/testing/sim_server.hpp"
#include "tests/support/source_dir.hpp"

namespace canyon::adapters::gz_sim {
namespace {

TEST(Worlds, DowntownsCarDrivesByTopicAndHasAFix) {
  gz::sim::ServerConfig config;
  config.SetSdfFile(std::string(canyon_source_dir) + "/adapters/gz_sim/worlds/canyon_downtown.sdf");
  test::SimServer server(config);
  test::GnssListener listener("/world/canyon_downtown/model/car/link/body/sensor/gnss/gnss");
  gz::transport::Node node;
  auto drive = node.Advertise<gz::msgs::Twist>("/model/car/cmd_vel");
  gz::msgs::Twist forward;
  forward.mutable_linear()->set_x(8);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  double first = 0, last = -78;
  bool fixed = false;
  // 30 m along the street; it begins at x = -78 m.
  while (last < -48 && std::chrono::steady_clock::now() < deadline) {
    drive.Publish(forward);
    server.step(250);
    const auto messages = listener.all();
    if (messages.empty()) continue;
    first = messages.front().antenna_world_m().x();
    last = messages.back().antenna_world_m().x();
    fixed = fixed || messages.back().state() == msgs::GnssReceiver::FIX;
  }
  EXPECT_NEAR(first, -78, 1);
  EXPECT_GT(last, -48);
  EXPECT_TRUE(fixed);
  EXPECT_NEAR(listener.all().back().antenna_world_m().y(), -26, 0.5) << "straight on";
}

}  // namespace
}  // namespace canyon::adapters::gz_sim
