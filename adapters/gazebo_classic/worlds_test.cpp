// The worlds that come with the plugin: they load and behave as documented in their comments.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>

#include "adapters/gazebo_classic/testing/gnss_listener.hpp"
#include "adapters/gazebo_classic/testing/in_process_server.hpp"
#include "tests/support/source_dir.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using msgs::GnssReceiver;
using msgs::GnssSatellite;
using test::GnssListener;
using test::InProcessServer;

constexpr double kDeg = std::numbers::pi / 180;

[[nodiscard]] std::filesystem::path world_file(const char* name) {
  return std::filesystem::path(canyon_source_dir) / "adapters/gazebo_classic/worlds" / name;
}

[[nodiscard]] std::optional<GnssReceiver> observe(const char* world) {
  InProcessServer& server = InProcessServer::get();
  const auto loaded = server.load_file(world_file(world));
  GnssListener listener(loaded->Name(), "~/car/gnss/gnss");
  server.step(20);
  return listener.at(0.1);
}

TEST(Worlds, TwoWallsGivesTheOffsetsOfItsComment) {
  const auto message = observe("two_walls.world");
  ASSERT_TRUE(message);
  ASSERT_EQ(message->satellites_size(), 8);
  const auto& satellite = [&](int number) -> const GnssSatellite& { return message->satellites(number - 1); };
  for (const int number : {3, 4, 5, 7, 8}) {
    EXPECT_EQ(satellite(number).visibility(), GnssSatellite::LOS) << number;
  }
  EXPECT_EQ(satellite(1).visibility(), GnssSatellite::NLOS);
  EXPECT_EQ(satellite(2).visibility(), GnssSatellite::NLOS);
  EXPECT_EQ(satellite(6).visibility(), GnssSatellite::BLOCKED);
  // The closed forms of the file; the antenna is above the world's origin.
  EXPECT_NEAR(satellite(1).excess_m(), 16 * std::cos(45 * kDeg), 1e-3);
  EXPECT_NEAR(satellite(2).excess_m(), 24 * std::cos(30 * kDeg), 1e-3);
  EXPECT_EQ(message->state(), GnssReceiver::FIX);
  ASSERT_EQ(message->scan_ranges_m_size(), 16);
  EXPECT_NEAR(message->scan_ranges_m(0), 12 / std::cos(45 * kDeg), 1e-3);
  EXPECT_NEAR(message->scan_ranges_m(1), 8 / std::cos(45 * kDeg), 1e-3);
}

TEST(Worlds, SkyCameraHasSatellitesOfEveryKind) {
  const auto message = observe("sky_camera.world");
  ASSERT_TRUE(message);
  std::array<int, 4> count{};
  for (const GnssSatellite& s : message->satellites()) {
    if (s.above_mask()) ++count.at(static_cast<std::size_t>(s.visibility()));
  }
  EXPECT_THAT(count, testing::Each(testing::Gt(0))) << "LOS, LOS+multipath, NLOS, blocked";
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
