#include "canyon/simulation/motion/smooth_poses.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"

namespace canyon::simulation {
namespace {

using Eigen::Vector3d;

constexpr double kStep_s = 0.04;
constexpr double kRadius_m = 30, kRate_radps = 0.4;  // 12 m/s, 4.8 m/s^2

class SmoothPosesTest : public ::testing::Test {
 protected:
  /// A circle to the left that begins eastwards.
  static RigidPose circle(double t_s) {
    const double angle = kRate_radps * t_s;
    RigidPose body;
    body.position_m = kRadius_m * Vector3d(std::sin(angle), 1 - std::cos(angle), 0);
    body.attitude = Eigen::AngleAxisd(angle, Vector3d::UnitZ());
    body.linear_velocity = kRadius_m * kRate_radps * Vector3d(std::cos(angle), std::sin(angle), 0);
    body.angular_velocity = {0, 0, kRate_radps};
    return body;
  }
  void send(const RigidPose& body, double t_s) {
    const std::int64_t ns = std::llround(t_s * 1e9);
    (void)track_.add({body, t_s, body.linear_velocity, body.angular_velocity}, ns);
    poses_.follow(track_, ns);
  }
  void drive(double from_s, double to_s, double interval_s = 0.02) {
    for (int k = 0; from_s + k * interval_s <= to_s + 1e-9; ++k)
      send(circle(from_s + k * interval_s), from_s + k * interval_s);
  }

  geodesy::LocalFrame frame_{geodesy::Geodetic::from_degrees(22.3, 114.17, 5)};
  PoseTrack track_{"test", {0.5, kStep_s, true}};
  SmoothPoses poses_{frame_, kStep_s};
};

// A mean over a variance of step^2 / 2 is a step^2 / 4 inside the bend.
TEST_F(SmoothPosesTest, FollowTheBend) {
  drive(0, 6);
  ASSERT_TRUE(poses_.holds(5'000'000'000));
  const double inside_m = kRadius_m * kRate_radps * kRate_radps * kStep_s * kStep_s / 4;
  for (double t = 1; t < 5; t += 0.0137) {
    const RigidPose body = poses_.at(t), truth = circle(t);
    const Vector3d centre(0, kRadius_m, 0);
    EXPECT_NEAR((body.position_m - centre).norm(), kRadius_m - inside_m, 1e-4);
    EXPECT_NEAR((body.linear_velocity - truth.linear_velocity).norm(), 0, 5e-3);
    EXPECT_NEAR(body.attitude.angularDistance(truth.attitude), 0, 1e-5);
    EXPECT_NEAR((body.angular_velocity - truth.angular_velocity).norm(), 0, 1e-5);
    // The acceleration is that of the bend, in ECEF as well, and continuous.
    const EcefPose ecef = poses_.ecef_at(t);
    EXPECT_NEAR(ecef.acceleration_mps2.norm(), kRadius_m * kRate_radps * kRate_radps, 0.02);
    EXPECT_NEAR((poses_.ecef_at(t + 1e-4).acceleration_mps2 - ecef.acceleration_mps2).norm(), 0, 2e-3);
    const EcefPose later = poses_.ecef_at(t + 1e-3);
    EXPECT_NEAR(((later.position_m - ecef.position_m) / 1e-3 - ecef.velocity_mps).norm(), 0, 5e-3);
    const Pose pose = poses_.pose_at(t, {});
    EXPECT_NEAR(std::remainder(pose.yaw_rad - kRate_radps * t, 2 * geodesy::kPi), 0, 1e-4);
    EXPECT_NEAR(pose.yaw_rate_radps, kRate_radps, 1e-4);
    EXPECT_NEAR(pose.velocity_enu_mps.norm(), kRadius_m * kRate_radps, 5e-3);
  }
}

// 10 ms before a point, three further ones are needed.
TEST_F(SmoothPosesTest, AreLateByThreeSteps) {
  EXPECT_EQ(poses_.needs_ns(1'000'000'000), 1'120'000'000);
  EXPECT_EQ(poses_.needs_ns(1'035'000'000), 1'160'000'000);
  drive(0, 1.1);
  EXPECT_FALSE(poses_.holds(1'000'000'000));
  EXPECT_TRUE(poses_.holds(940'000'000));
  drive(1.12, 1.12);
  EXPECT_TRUE(poses_.holds(1'000'000'000));
  // Further poses do not change it.
  const Vector3d point = poses_.at(1).position_m;
  drive(1.14, 2);
  EXPECT_EQ(point, poses_.at(1).position_m);
}

// The first two points give the velocity: in a bend that of half a step later, 4.8 m/s^2 * 0.02 s.
TEST_F(SmoothPosesTest, BeginWithTheSpeedOfTheFirstPoses) {
  EXPECT_FALSE(poses_.holds(0));
  drive(0, 1);
  ASSERT_TRUE(poses_.holds(0));
  EXPECT_EQ(poses_.begin_s(), 0);
  EXPECT_NEAR((poses_.at(0).linear_velocity - circle(0).linear_velocity).norm(), 0, 0.11);
  EXPECT_LT(poses_.ecef_at(0).acceleration_mps2.norm(), 5);
}

// Without poses the motion continues as the track extrapolates, and ends with it.
TEST_F(SmoothPosesTest, EndInAPauseAndBeginAnew) {
  drive(0, 2);
  poses_.reach(track_, 2'200'000'000);
  EXPECT_TRUE(poses_.holds(2'200'000'000));
  poses_.reach(track_, 2'600'000'000);
  EXPECT_FALSE(poses_.holds(2'600'000'000));
  drive(4, 5);
  EXPECT_FALSE(poses_.holds(3'000'000'000));
  ASSERT_TRUE(poses_.holds(4'500'000'000));
  EXPECT_EQ(poses_.begin_s(), 4);
  EXPECT_NEAR((poses_.at(4.5).position_m - circle(4.5).position_m).norm(), 0, 3e-3);
}

TEST_F(SmoothPosesTest, BeginAnewElsewhere) {
  drive(0, 2);
  RigidPose far = circle(2.02);
  far.position_m.x() += 5000;
  for (double t = 2.02; t < 3; t += 0.02) send(far, t);
  EXPECT_NEAR(poses_.begin_s(), 2.04, 1e-9);
  EXPECT_NEAR(poses_.at(2.5).linear_velocity.norm(), 0, 1e-3);
}

TEST_F(SmoothPosesTest, SayThatPosesAreSparse) {
  drive(0, 2);
  EXPECT_FALSE(poses_.sparse_s());
  drive(2.1, 3, 0.1);
  ASSERT_TRUE(poses_.sparse_s());
  EXPECT_NEAR(*poses_.sparse_s(), 0.1, 0.01);
}

}  // namespace
}  // namespace canyon::simulation
