#include "adapters/common/pose_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace canyon::adapters {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

void expect_near(const Vector3d& actual, const Vector3d& expected, double tolerance) {
  EXPECT_LE((actual - expected).norm(), tolerance)
      << actual.transpose() << ", expected " << expected.transpose();
}

TEST(MotionBetween, IsTheStraightWayAndTheShorterTurn) {
  const Vector3d axis = Vector3d(1, -2, 3).normalized();
  const Quaterniond start(AngleAxisd(0.9, Vector3d(0.3, -0.2, 1.1).normalized()));
  const RigidPose from{{1, 2, 3}, start};
  const RigidPose to{{1.5, 1, 3.25}, Quaterniond(AngleAxisd(0.7, axis)) * start};
  const TruePose motion = motion_between(from, to, 0.25);
  EXPECT_EQ(motion.pose.position_m, to.position_m);
  EXPECT_EQ(motion.pose.attitude.coeffs(), to.attitude.coeffs());
  expect_near(motion.linear_velocity, {2, -4, 1}, 1e-12);
  expect_near(motion.angular_velocity, axis * (0.7 / 0.25), 1e-12);
  // Both signs of a quaternion are one attitude.
  RigidPose flipped = to;
  flipped.attitude.coeffs() *= -1;
  expect_near(motion_between(from, flipped, 0.25).angular_velocity, axis * (0.7 / 0.25), 1e-12);
  // More than half a turn is less than half a turn the other way.
  const RigidPose far{from.position_m, Quaterniond(AngleAxisd(4, axis)) * start};
  expect_near(motion_between(from, far, 1).angular_velocity, axis * (4 - 2 * M_PI), 1e-12);
  expect_near(motion_between(from, from, 0.1).angular_velocity, Vector3d::Zero(), 1e-12);
}

TEST(MotionBetween, IsNoneOverTeleports) {
  const RigidPose from;
  const Quaterniond turned(AngleAxisd(0.1, Vector3d::UnitZ()));
  expect_near(motion_between(from, {{99.9, 0, 0}, turned}, 0.1).linear_velocity, {999, 0, 0}, 1e-9);
  const TruePose jump = motion_between(from, {{100.1, 0, 0}, turned}, 0.1);
  EXPECT_EQ(jump.linear_velocity, Vector3d::Zero());
  EXPECT_EQ(jump.angular_velocity, Vector3d::Zero());
  EXPECT_EQ(jump.pose.position_m.x(), 100.1);
}

TEST(ProperPose, NormalizesAndRefuses) {
  const auto pose = proper_pose({{1, 2, 3}, Quaterniond(0, 0, 0, 5)});
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->position_m, Vector3d(1, 2, 3));
  EXPECT_EQ(pose->attitude.coeffs(), Quaterniond(0, 0, 0, 1).coeffs());
  EXPECT_FALSE(proper_pose({{1, 2, 3}, Quaterniond(0, 0, 0, 0)}));
  EXPECT_FALSE(proper_pose({{1, 2, 3}, Quaterniond(1, 0, kNan, 0)}));
  for (const Vector3d& place : {Vector3d(kNan, 0, 0), Vector3d(0, HUGE_VAL, 0), Vector3d(0, 0, -HUGE_VAL)}) {
    EXPECT_FALSE(proper_pose({place, Quaterniond::Identity()}));
  }
}

TEST(Yaw, IsThatOfTheForwardAxis) {
  for (const double yaw : {-2.5, -0.3, 0.0, 1.1, 3.0}) {
    const Quaterniond attitude = AngleAxisd(yaw, Vector3d::UnitZ()) * AngleAxisd(0.4, Vector3d::UnitY()) *
                                 AngleAxisd(-0.7, Vector3d::UnitX());
    EXPECT_NEAR(yaw_of(attitude), yaw, 1e-12);
  }
}

// Hosts' own tests have the rest of PoseTrack, with messages that come in other threads.
TEST(PoseTrack, TakesTheSendersClockWhereItRuns) {
  PoseTrack track("/mocap/car", 0.3);
  std::string reason;
  EXPECT_FALSE(track.at(0, reason));
  EXPECT_EQ(reason, "no pose has come on /mocap/car yet");
  EXPECT_TRUE(track.add({{1, 0, 0}, Quaterniond::Identity()}, 100, 0));
  EXPECT_TRUE(track.add({{2, 0, 0}, Quaterniond::Identity()}, 100.01, 100'000'000));
  EXPECT_NEAR(track.at(100'000'000, reason)->linear_velocity.x(), 100, 1e-6);
  EXPECT_TRUE(track.add({{3, 0, 0}, Quaterniond::Identity()}, 100.01, 200'000'000));
  EXPECT_NEAR(track.at(200'000'000, reason)->linear_velocity.x(), 10, 1e-9);
  EXPECT_FALSE(track.add({{kNan, 0, 0}, Quaterniond::Identity()}, 101, 300'000'000));
  EXPECT_TRUE(track.at(500'000'000, reason));
  EXPECT_FALSE(track.at(500'000'001, reason));
  EXPECT_EQ(reason, "the last pose on /mocap/car is 0.3 s old");
}

}  // namespace
}  // namespace canyon::adapters
