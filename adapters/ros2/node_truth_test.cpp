#include "adapters/ros2/node_truth.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <limits>
#include <numbers>

#include "adapters/ros2/testing/rtcm_base.hpp"

namespace canyon::adapters::ros2 {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::int64_t kSecond = 1'000'000'000;

NodeSettings open_field(const Parameters& more = {}) {
  Parameters given{{"city.open", true},
                   {"city.origin.latitude_deg", 22.3},
                   {"city.origin.longitude_deg", 114.17},
                   {"start", "2026-06-01T08:00:00Z"},
                   {"profile", "ideal"},
                   {"pose.source", "pose"}};
  for (const auto& [name, value] : more) given[name] = value;
  return read_settings(given);
}

Eigen::Quaterniond yaw(double radians) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(radians, Eigen::Vector3d::UnitZ()));
}

TEST(NodeTruth, SaysWhyThereIsNoEpoch) {
  const auto poses = test::make_receiver(open_field(), "/receiver");
  std::string reason;
  EXPECT_FALSE(poses->observe(kSecond, reason));
  EXPECT_THAT(reason, HasSubstr("pose"));
  EXPECT_THAT(poses->add({{std::numeric_limits<double>::quiet_NaN(), 0, 0}, yaw(0)}, 0, kSecond),
              HasSubstr("poses on pose are dropped"));
  EXPECT_THAT(poses->add({{0, 0, 1}, yaw(0)}, 0, kSecond), IsEmpty());
  EXPECT_TRUE(poses->observe(kSecond, reason));
  EXPECT_FALSE(poses->observe(2 * kSecond, reason));  // older than 0.5 s
}

// The antenna's position by hand: the frame's x axis points north, its origin is 100 m east and 20 m north of
// the city's; the vehicle is at 10 m along x and 3 m along y, heads along y (which is west) and has its
// antenna 2 m ahead and 1 m up. East 100 - 3 - 2, north 20 + 10, up 1.
TEST(NodeTruth, PutsTheFrameIntoTheCity) {
  const auto poses = test::make_receiver(open_field({{"pose.east_m", 100.0},
                                                     {"pose.north_m", 20.0},
                                                     {"pose.heading_deg", 90.0},
                                                     {"lever_arm.forward_m", 2.0},
                                                     {"lever_arm.up_m", 1.0}}),
                                         "/receiver");
  const Eigen::Quaterniond along_y = yaw(std::numbers::pi / 2);
  std::string reason;
  EXPECT_THAT(poses->add({{10, 3, 0}, along_y}, 10.0, kSecond), IsEmpty());
  EXPECT_THAT(poses->add({{10, 4, 0}, along_y}, 10.5, kSecond + kSecond / 2),
              IsEmpty());  // 2 m/s to the west
  const auto step = poses->observe(kSecond + kSecond / 2, reason);
  ASSERT_TRUE(step) << reason;
  const geodesy::LocalFrame frame(geodesy::Geodetic::from_degrees(22.3, 114.17, 0));
  const Eigen::Vector3d enu = frame.local_from_geodetic(step->epoch.truth.position);
  EXPECT_NEAR(enu.x(), 100 - 4 - 2, 1e-6);
  EXPECT_NEAR(enu.y(), 20 + 10, 1e-6);
  EXPECT_NEAR(enu.z(), 1, 1e-6);
  EXPECT_NEAR(step->epoch.truth.velocity_enu_mps.x(), -2, 1e-4);  // its own east differs by 100 m / 6400 km
  EXPECT_NEAR(step->epoch.truth.velocity_enu_mps.y(), 0, 1e-4);
  EXPECT_NEAR(std::abs(step->epoch.truth.yaw_rad), std::numbers::pi, 1e-5);
  // The profile ideal has no noise: the fix is the truth (solve_fix(): within 0.1 mm).
  ASSERT_TRUE(step->epoch.observed.fix.solved());
  EXPECT_LT(step->epoch.error_enu_m.norm(), 1e-3);
}

TEST(NodeTruth, ChangesItsReceiverAndNotItsPlace) {
  const auto poses = test::make_receiver(open_field(), "/receiver");
  std::string reason;
  ASSERT_THAT(poses->add({{0, 0, 1}, yaw(0)}, 0, 0), IsEmpty());
  const auto above = [&](const Parameters& more) {
    poses->change(open_field(more));
    const auto step = poses->observe(kSecond / 10, reason);
    return step ? step->epoch.observed.visible : -1;
  };
  const int low = above({{"elevation_mask_deg", 5.0}});
  const int high = above({{"elevation_mask_deg", 60.0}});
  EXPECT_GT(high, 0);
  EXPECT_GT(low, high);
}

}  // namespace
}  // namespace canyon::adapters::ros2
