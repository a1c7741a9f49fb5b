#include "canyon/simulation/motion/pose_motion.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <limits>

namespace canyon::simulation {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

ReportedPose sent(const RigidPose& pose, double stamp_s) {
  return {pose, stamp_s, {}, {}};
}

void expect_near(const Vector3d& actual, const Vector3d& expected, double tolerance) {
  EXPECT_LE((actual - expected).norm(), tolerance)
      << actual.transpose() << ", expected " << expected.transpose();
}

TEST(MotionBetween, IsTheStraightWayAndTheShorterTurn) {
  const Vector3d axis = Vector3d(1, -2, 3).normalized();
  const Quaterniond start(AngleAxisd(0.9, Vector3d(0.3, -0.2, 1.1).normalized()));
  const RigidPose from{{1, 2, 3}, start};
  const RigidPose to{{1.5, 1, 3.25}, Quaterniond(AngleAxisd(0.7, axis)) * start};
  const RigidPose motion = motion_between(from, to, 0.25);
  EXPECT_EQ(motion.position_m, to.position_m);
  EXPECT_EQ(motion.attitude.coeffs(), to.attitude.coeffs());
  expect_near(motion.linear_velocity, {2, -4, 1}, 1e-12);
  expect_near(motion.angular_velocity, axis * (0.7 / 0.25), 1e-12);
  // Both signs of a quaternion are one attitude.
  RigidPose flipped = to;
  flipped.attitude.coeffs() *= -1;
  expect_near(motion_between(from, flipped, 0.25).angular_velocity, axis * (0.7 / 0.25), 1e-12);
  // More than half a turn is less than half a turn in the other direction.
  const RigidPose far{from.position_m, Quaterniond(AngleAxisd(4, axis)) * start};
  expect_near(motion_between(from, far, 1).angular_velocity, axis * (4 - 2 * M_PI), 1e-12);
  expect_near(motion_between(from, from, 0.1).angular_velocity, Vector3d::Zero(), 1e-12);
}

TEST(MotionBetween, IsNoneOverTeleports) {
  const RigidPose from;
  const Quaterniond rotated(AngleAxisd(0.1, Vector3d::UnitZ()));
  expect_near(motion_between(from, {{99.9, 0, 0}, rotated}, 0.1).linear_velocity, {999, 0, 0}, 1e-9);
  const RigidPose jump = motion_between(from, {{100.1, 0, 0}, rotated}, 0.1);
  EXPECT_EQ(jump.linear_velocity, Vector3d::Zero());
  EXPECT_EQ(jump.angular_velocity, Vector3d::Zero());
  EXPECT_EQ(jump.position_m.x(), 100.1);
}

TEST(ProperPose, NormalizesAndRefuses) {
  const auto pose = proper_pose({{1, 2, 3}, Quaterniond(0, 0, 0, 5)});
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->position_m, Vector3d(1, 2, 3));
  EXPECT_EQ(pose->attitude.coeffs(), Quaterniond(0, 0, 0, 1).coeffs());
  EXPECT_FALSE(proper_pose({{1, 2, 3}, Quaterniond(0, 0, 0, 0)}));
  EXPECT_FALSE(proper_pose({{1, 2, 3}, Quaterniond(1, 0, kNan, 0)}));
  for (const Vector3d& position :
       {Vector3d(kNan, 0, 0), Vector3d(0, HUGE_VAL, 0), Vector3d(0, 0, -HUGE_VAL)}) {
    EXPECT_FALSE(proper_pose({position, Quaterniond::Identity()}));
  }
}

// Hosts' own tests cover the rest of PoseTrack, with messages on other threads.
TEST(PoseTrack, TakesTheSendersClockWhereItRuns) {
  PoseTrack track("/mocap/car", {0.3});
  std::string reason;
  EXPECT_FALSE(track.at(0, reason));
  EXPECT_EQ(reason, "no pose has come on /mocap/car yet");
  EXPECT_EQ(track.add(sent({{1, 0, 0}, Quaterniond::Identity()}, 100), 0), PoseTrack::PoseResult::Yes);
  EXPECT_EQ(track.add(sent({{2, 0, 0}, Quaterniond::Identity()}, 100.01), 100'000'000),
            PoseTrack::PoseResult::Yes);
  EXPECT_NEAR(track.at(100'000'000, reason)->linear_velocity.x(), 100, 1e-6);
  EXPECT_EQ(track.add(sent({{3, 0, 0}, Quaterniond::Identity()}, 100.01), 200'000'000),
            PoseTrack::PoseResult::Yes);
  EXPECT_NEAR(track.at(200'000'000, reason)->linear_velocity.x(), 10, 1e-9);
  EXPECT_EQ(track.add(sent({{kNan, 0, 0}, Quaterniond::Identity()}, 101), 300'000'000),
            PoseTrack::PoseResult::NoPose);
  EXPECT_TRUE(track.at(500'000'000, reason));
  EXPECT_FALSE(track.at(500'000'001, reason));
  EXPECT_EQ(reason, "the last pose on /mocap/car is 0.3 s old");
}

constexpr std::int64_t kMs = 1'000'000;

ReportedPose at_x(double x, double stamp_s) {
  return sent({{x, 2 * x, -x}, Quaterniond(AngleAxisd(x / 10, Vector3d::UnitZ()))}, stamp_s);
}

TEST(PoseTrack, GoesOnForABoundedTimeAndThenKnowsNoTruth) {
  PoseTrack track("udp", {0.3});
  std::string reason;
  track.add(at_x(0, 7), 0);
  track.add(at_x(1, 7.1), 100 * kMs);
  const auto ahead = track.at(350 * kMs, reason);
  ASSERT_TRUE(ahead);
  // 0.25 s later at (10, 20, -10) m/s, rotating by 1 rad/s.
  expect_near(ahead->position_m, {3.5, 7, -3.5}, 1e-9);
  EXPECT_NEAR(ahead->attitude.angularDistance(Quaterniond(AngleAxisd(0.35, Vector3d::UnitZ()))), 0, 1e-9);
  EXPECT_TRUE(track.at(400 * kMs, reason));
  EXPECT_FALSE(track.at(400 * kMs + 1, reason));
}

TEST(PoseTrack, DropsWhatCameBeforeAndWhatIsOlder) {
  PoseTrack track("udp", {0.5});
  std::string reason;
  EXPECT_EQ(track.add(at_x(0, 7), 0), PoseTrack::PoseResult::Yes);
  EXPECT_EQ(track.add(at_x(1, 7.1), 100 * kMs), PoseTrack::PoseResult::Yes);
  EXPECT_EQ(track.add(at_x(1, 7.1), 110 * kMs), PoseTrack::PoseResult::Old);     // twice
  EXPECT_EQ(track.add(at_x(0.5, 7.05), 120 * kMs), PoseTrack::PoseResult::Old);  // overtaken
  // A dropped pose does not extend the track.
  EXPECT_TRUE(track.at(600 * kMs, reason));
  EXPECT_FALSE(track.at(601 * kMs, reason));
  // A sender that restarts.
  EXPECT_EQ(track.add(at_x(5, 0.1), 700 * kMs), PoseTrack::PoseResult::Yes);
  EXPECT_EQ(track.at(700 * kMs, reason)->linear_velocity, Vector3d::Zero());
}

TEST(PoseTrack, TakesLatePosesForWhatTheyWere) {
  PoseTrack track("udp", {0.5, 0, true});
  std::string reason;
  // 10 m/s; each message is delayed by 5 ms, the last one by 45.
  for (int i = 0; i <= 20; ++i) track.add(at_x(0.1 * i, 50 + 0.01 * i), (5 + 10 * i) * kMs);
  track.add(at_x(2.1, 50.21), (45 + 210) * kMs);
  // The message with the least delay defines the clock: that of stamp 50.2 counts as of 205 ms.
  EXPECT_NEAR(track.at(205 * kMs, reason)->position_m.x(), 2, 1e-3);
  EXPECT_NEAR(track.at(255 * kMs, reason)->position_m.x(), 2.5, 1e-3);
  EXPECT_NEAR(track.at(203 * kMs, reason)->position_m.x(), 1.98, 1e-3);  // between two poses
  EXPECT_TRUE(track.reaches(215 * kMs));
  EXPECT_FALSE(track.reaches(216 * kMs));
}

// A log, or poses that define the run's time, contain poses after a pause before it is over.
TEST(PoseTrack, KeepsPosesBehindAPauseUntilTheirTime) {
  PoseTrack track("log", {0.5, 0, true});
  std::string reason;
  for (const int ms : {0, 100, 200, 20'000, 20'100}) track.add(at_x(0.01 * ms, 1e-3 * ms), ms * kMs);
  EXPECT_NEAR(track.at(150 * kMs, reason)->position_m.x(), 1.5, 1e-9);
  EXPECT_NEAR(track.at(700 * kMs, reason)->position_m.x(), 7, 1e-9);  // moved on
  for (const int ms : {701, 5'000, 19'400, 19'999}) EXPECT_FALSE(track.at(ms * kMs, reason)) << ms;
  EXPECT_EQ(reason, "the previous pose on log is 19.8 s old");
  EXPECT_NEAR(track.at(20'050 * kMs, reason)->position_m.x(), 200.5, 1e-9);
  EXPECT_TRUE(track.at(0, reason)) << "of another receiver on the vehicle";
  // Poses two time-outs apart are not a pause.
  track.add(at_x(210.1, 21.1), 21'100 * kMs);
  EXPECT_NEAR(track.at(20'300 * kMs, reason)->position_m.x(), 201 + 9.1 * 0.2, 1e-9);
}

TEST(PoseTrack, AveragesTheNoiseOfMeasuredPoses) {
  const auto speed = [](double smoothing_s) {
    PoseTrack track("mocap", {0.5, smoothing_s, true});
    // 10 m/s, and an error of 1 cm in the last pose, 10 ms after the previous one.
    for (int i = 0; i <= 20; ++i) {
      track.add(sent({{0.1 * i + (i == 20 ? 0.01 : 0), 0, 0}, Quaterniond::Identity()}, 0.01 * i),
                std::int64_t{10} * i * kMs);
    }
    std::string reason;
    return track.at(200 * kMs, reason)->linear_velocity.x();
  };
  EXPECT_NEAR(speed(0), 10 + 0.01 / 0.01, 1e-9);
  EXPECT_NEAR(speed(0.05), 10 + 0.01 / 0.05, 1e-9);
}

TEST(PoseTrack, TakesTheSendersVelocities) {
  PoseTrack track("odometry", {0.5});
  std::string reason;
  ReportedPose pose = at_x(3, 1);
  pose.linear_velocity = Vector3d(4, -5, 6);
  track.add(pose, 0);
  EXPECT_EQ(track.at(0, reason)->linear_velocity, Vector3d(4, -5, 6));
  pose.linear_velocity = Vector3d(4, kNan, 6);
  EXPECT_EQ(track.add(pose, kMs), PoseTrack::PoseResult::NoPose);
}

TEST(PoseOf, TurnsArmAndMotionIntoTheCity) {
  RigidPose body{{10, 20, 30}, Quaterniond(AngleAxisd(M_PI / 2, Vector3d::UnitZ())), {1, 2, 3}, {0, 0, 0.5}};
  // Forward of the body is y of its frame; the frame is rotated by 90 deg and shifted in the city.
  const geodesy::LocalFrame city({0.4, 2, 10});
  const Pose antenna = pose_of(body, {city, M_PI / 2, {1000, 2000, 3000}}, {}, {0.4, 0.1, 0.2});
  const Vector3d arm(-0.1, 0.4, 0.2);
  const Vector3d point = body.position_m + arm, velocity(1 - 0.5 * 0.4, 2 - 0.5 * 0.1, 3);
  expect_near(city.local_from_geodetic(antenna.position),
              {1000 - point.y(), 2000 + point.x(), 3000 + point.z()}, 1e-8);
  const Eigen::Matrix3d city_from_sensor = city.ecef_from_local_rotation().transpose() *
                                           geodesy::enu_from_ecef_rotation(antenna.position).transpose();
  expect_near(city_from_sensor * antenna.velocity_enu_mps, {-velocity.y(), velocity.x(), velocity.z()}, 1e-9);
  // It faces west in the city, whose meridian differs from its own.
  expect_near(city_from_sensor * antenna.forward_enu(), {-1, 0, 0}, 1e-9);
  expect_near(city_from_sensor * antenna.up_enu(), {0, 0, 1}, 1e-9);
  EXPECT_NEAR(antenna.yaw_rate_radps, 0.5, 1e-6);
}

TEST(PoseOf, HasYawPitchAndRoll) {
  for (const double yaw : {-2.5, -0.3, 0.0, 1.1, 3.0}) {
    const Quaterniond attitude(AngleAxisd(yaw, Vector3d::UnitZ()) * AngleAxisd(-0.4, Vector3d::UnitY()) *
                               AngleAxisd(-0.7, Vector3d::UnitX()));
    const Pose pose = pose_of({Vector3d::Zero(), attitude}, {geodesy::LocalFrame({0.4, 2, 10})}, {});
    EXPECT_NEAR(pose.yaw_rad, yaw, 1e-9);
    EXPECT_NEAR(pose.pitch_rad, 0.4, 1e-9);
    EXPECT_NEAR(pose.roll_rad, -0.7, 1e-9);
  }
}

}  // namespace
}  // namespace canyon::simulation
