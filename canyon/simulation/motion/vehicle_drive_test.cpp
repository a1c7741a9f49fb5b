#include "canyon/simulation/motion/vehicle_drive.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "canyon/simulation/motion/trajectory.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::simulation {
namespace {

using Eigen::Vector3d;
using geodesy::Geodetic;
using geodesy::GpsTime;
using geodesy::LocalFrame;

// 5 m along a 3-4-5 triangle, 4 m up, then back over 3 m along -x; 2 m/s, 1 s at each.
const std::vector<Vector3d> kPath = {{1, 2, 0.5}, {4, 6, 0.5}, {4, 6, 4.5}, {1, 6, 4.5}};

TEST(VehicleDrive, FollowsWaypointsAtOneSpeed) {
  const VehicleDrive drive = VehicleDrive::along_waypoints(kPath, {2, 1, false});
  // Legs of 2.5, 2 and 1.5 s, and four times one second.
  EXPECT_DOUBLE_EQ(drive.end_s(), 10);
  const auto expect = [&](double seconds, const Vector3d& position, const Vector3d& velocity, double yaw) {
    const DrivePose pose = drive.at(seconds);
    EXPECT_LT((pose.position_m - position).norm(), 1e-12) << seconds;
    EXPECT_LT((pose.velocity_mps - velocity).norm(), 1e-12) << seconds;
    EXPECT_NEAR(pose.yaw_rad, yaw, 1e-12) << seconds;
    EXPECT_EQ(pose.yaw_rate_radps, 0) << seconds;
  };
  const double first = std::atan2(4, 3);
  const Vector3d zero = Vector3d::Zero();
  expect(-3, kPath[0], zero, first);  // has the heading of its first leg
  expect(0.5, kPath[0], zero, first);
  expect(2, {1 + 1.2, 2 + 1.6, 0.5}, {1.2, 1.6, 0}, first);
  expect(4, kPath[1], zero, first);
  expect(5.5, {4, 6, 2.5}, {0, 0, 2}, first);  // straight up: the yaw is held
  expect(6.5, kPath[2], zero, first);
  expect(8, {3, 6, 4.5}, {-2, 0, 0}, M_PI);
  expect(9.5, kPath[3], zero, M_PI);
  expect(1e6, kPath[3], zero, M_PI);
}

TEST(VehicleDrive, GoesRoundAndRound) {
  const VehicleDrive drive =
      VehicleDrive::along_waypoints({{0, 0, 0}, {30, 0, 0}, {30, 40, 0}}, {10, 0, true});
  // 3 + 4 + 5 s, the last leg back to the first.
  EXPECT_DOUBLE_EQ(drive.end_s(), 12);
  for (const double lap : {0.0, 12.0, 1200.0}) {
    const DrivePose pose = drive.at(lap + 9.5);
    EXPECT_LT((pose.position_m - Vector3d(15, 20, 0)).norm(), 1e-9);
    EXPECT_LT((pose.velocity_mps - Vector3d(-6, -8, 0)).norm(), 1e-12);
  }
  EXPECT_LT((drive.at(-1).position_m).norm(), 1e-12);
  EXPECT_EQ(drive.at(-1).velocity_mps.norm(), 0);
}

TEST(VehicleDrive, StandsAtOneWaypoint) {
  for (const bool loop : {false, true}) {
    const VehicleDrive drive = VehicleDrive::along_waypoints({{1, 2, 3}}, {10, 0, loop});
    EXPECT_EQ(drive.at(7).position_m, Vector3d(1, 2, 3));
    EXPECT_EQ(drive.at(7).velocity_mps.norm(), 0);
    EXPECT_EQ(drive.at(7).yaw_rad, 0);
  }
}

TEST(VehicleDrive, PlacesTrajectoriesByTheWorldsHeading) {
  const GpsTime start = GpsTime::from_week(2050, 1000);
  const Geodetic origin = Geodetic::from_degrees(22.3, 114.17, 5);
  const LocalFrame enu(origin);
  // 100 m north in 10 s, from 40 m east of the origin, 2 m above it.
  const auto north = Trajectory::from_waypoints(start + 4,
                                                {Waypoint{enu.geodetic_from_local({40, 0, 2}), 10},
                                                 Waypoint{enu.geodetic_from_local({40, 100, 2}), 10}},
                                                std::nullopt);
  // The world's x axis points north-west: its y axis south-west. East is -sin 135, -cos 135... of each.
  const double heading = 135 * M_PI / 180;
  const VehicleDrive drive = VehicleDrive::along_trajectory(north, start, LocalFrame(origin, heading), false);
  EXPECT_NEAR(drive.begin_s(), 4, 1e-9);
  EXPECT_NEAR(drive.end_s(), 14, 1e-6);
  const Vector3d x_axis(std::cos(heading), std::sin(heading), 0);  // in ENU
  const Vector3d y_axis(-std::sin(heading), std::cos(heading), 0);
  const DrivePose pose = drive.at(10);
  const Vector3d point(40, 60, 2);
  EXPECT_NEAR(pose.position_m.x(), point.dot(x_axis), 1e-3);
  EXPECT_NEAR(pose.position_m.y(), point.dot(y_axis), 1e-3);
  EXPECT_NEAR(pose.position_m.z(), 2, 1e-3);
  EXPECT_NEAR(pose.velocity_mps.x(), 10 * x_axis.y(), 1e-3);
  EXPECT_NEAR(pose.velocity_mps.y(), 10 * y_axis.y(), 1e-3);
  EXPECT_NEAR(pose.yaw_rad, M_PI / 2 - heading, 1e-4);  // north, from the x axis
  EXPECT_EQ(drive.at(2).velocity_mps.norm(), 0);
  EXPECT_LT((drive.at(2).position_m - drive.at(4).position_m).norm(), 1e-9);
  EXPECT_EQ(drive.at(15).velocity_mps.norm(), 0);
  const VehicleDrive round = VehicleDrive::along_trajectory(north, start, LocalFrame(origin, heading), true);
  EXPECT_LT((round.at(10 + 2 * 10).position_m - pose.position_m).norm(), 1e-4);
}

TEST(VehicleDrive, RefusesWhatItCannotFollow) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto waypoints = [](const std::vector<Vector3d>& points, double speed, double hold) {
    return canyon::test::refusal([&] { (void)VehicleDrive::along_waypoints(points, {speed, hold, false}); });
  };
  EXPECT_NE(waypoints({}, 1, 0).find("list of waypoints is empty"), std::string::npos);
  EXPECT_NE(waypoints({{0, 0, 0}, {0, nan, 0}}, 1, 0).find("waypoint 2 is not finite"), std::string::npos);
  EXPECT_NE(waypoints(kPath, 0, 0).find("speed_mps: 0"), std::string::npos);
  EXPECT_NE(waypoints(kPath, nan, 0).find("speed_mps: nan"), std::string::npos);
  EXPECT_NE(waypoints(kPath, 1, -1).find("hold_s: -1"), std::string::npos);
  const Geodetic position = Geodetic::from_degrees(22.3, 114.17, 5);
  const GpsTime start = GpsTime::from_week(2050, 1000);
  const auto drive = Trajectory::fixed(start, position, 60);
  const auto along = [&](GpsTime zero, const LocalFrame& world) {
    return canyon::test::refusal([&] { (void)VehicleDrive::along_trajectory(drive, zero, world, false); });
  };
  EXPECT_NE(along(start, LocalFrame()).find("<spherical_coordinates>"), std::string::npos);
  EXPECT_NE(along(start + 61, LocalFrame(position)).find("ended 1.000 s before"), std::string::npos);
}

}  // namespace
}  // namespace canyon::simulation
