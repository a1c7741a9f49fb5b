#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/simulation/motion/antenna_pose.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::simulation {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;
using test::error_of;

constexpr double kGravity = 9.80665;  // standard gravity, CGPM 1901
const GpsTime kStart = GpsTime::from_week(2400, 100);
const geodesy::LocalFrame kFrame(Geodetic::from_degrees(22.3, 114.17, 10));

Geodetic at(double east_m, double north_m, double up_m = 0) {
  return kFrame.geodetic_from_local({east_m, north_m, up_m});
}
double east(const Pose& pose) {
  return kFrame.local_from_geodetic(pose.position).x();
}

// 100 m at 10 m/s and 2 m/s^2: 5 s and 25 m to speed up, as much to stop, 50 m between; 15 s.
TEST(SmoothDrive, SpeedsUpAndStops) {
  const Trajectory drive = Trajectory::from_waypoints(kStart, {Waypoint{at(0, 0)}, Waypoint{at(100, 0)}}, 2);
  EXPECT_NEAR(drive.end() - drive.begin(), 15, 1e-4);
  EXPECT_NEAR(east(drive.at(kStart + 5.0)), 25, 0.01);
  EXPECT_NEAR(east(drive.at(kStart + 7.5)), 50, 0.01);
  EXPECT_NEAR(drive.at(kStart + 2.0).velocity_enu_mps.x(), 4, 0.01);
  EXPECT_NEAR(drive.at(kStart + 7.5).velocity_enu_mps.x(), 10, 0.01);
  EXPECT_NEAR(drive.at(kStart + 14.0).velocity_enu_mps.x(), 2, 0.02);
  // Too short to reach its speed: 2 sqrt(d / a).
  const Trajectory hop = Trajectory::from_waypoints(kStart, {Waypoint{at(0, 0)}, Waypoint{at(8, 0)}}, 2);
  EXPECT_NEAR(hop.end() - hop.begin(), 4, 1e-4);
}

// A right angle between legs of 100 m at 10 m/s and 2 m/s^2 wants a radius of 50 m, whose arc would begin 50
// m before the corner; 45 % of the leg allow 45 m, driven at sqrt(2 * 45).
Trajectory corner() {
  return Trajectory::from_waypoints(kStart,
                                    {Waypoint{at(0, 0)}, Waypoint{at(100, 0)}, Waypoint{at(100, 100)}}, 2);
}

TEST(SmoothDrive, TurnsWithinTheAcceleration) {
  const Trajectory drive = corner();
  const double v = std::sqrt(90.0), arc_s = geodesy::kPi / 2 * 45 / v;
  // Each straight part of 55 m: up to the top speed and down to v (or the other way round).
  const double top = std::min(10.0, std::sqrt(2 * 55 + v * v / 2));
  const double cruise_m = 55 - top * top / 4 - (top * top - v * v) / 4;
  const double straight_s = top / 2 + (top - v) / 2 + cruise_m / top;
  EXPECT_NEAR(drive.end() - drive.begin(), 2 * straight_s + arc_s, 1e-3);
  const Pose middle = drive.at(kStart + straight_s + arc_s / 2);
  EXPECT_NEAR(middle.yaw_rate_radps, v / 45, 2e-3);
  EXPECT_NEAR(middle.yaw_rate_radps * middle.velocity_enu_mps.norm(), 2, 0.02);
  EXPECT_NEAR(middle.yaw_rad, geodesy::kPi / 4, 2e-3);
  // Nowhere more than the acceleration along and across together.
  Eigen::Vector3d before = drive.at(kStart).velocity_enu_mps;
  for (double t = 0.1; t < drive.end() - drive.begin(); t += 0.1) {
    const Eigen::Vector3d now = drive.at(kStart + t).velocity_enu_mps;
    EXPECT_LT((now - before).norm() / 0.1, 2 * std::sqrt(2.0) + 0.1) << t;
    before = now;
  }
}

// A hold is met, at rest; a turn back stops as well.
TEST(SmoothDrive, HoldsAreReached) {
  const Trajectory drive = Trajectory::from_waypoints(
      kStart, {Waypoint{at(0, 0)}, Waypoint{at(100, 0), 10, 20}, Waypoint{at(100, 100), 5}}, 2);
  EXPECT_NEAR(east(drive.at(kStart + 25.0)), 100, 1e-3);
  EXPECT_LT(drive.at(kStart + 25.0).velocity_enu_mps.norm(), 1e-6);
  // 100 m at 5 m/s: 2.5 s and 6.25 m twice, 87.5 m between.
  EXPECT_NEAR(drive.end() - drive.begin(), 15 + 20 + 2 * 2.5 + 17.5, 1e-3);
  const Trajectory back =
      Trajectory::from_waypoints(kStart, {Waypoint{at(0, 0)}, Waypoint{at(100, 0)}, Waypoint{at(0, 0)}}, 2);
  EXPECT_NEAR(back.end() - back.begin(), 30, 1e-3);
}

// A level way of 20 km stays level over the ellipsoid, though its chord lies 8 m below.
TEST(SmoothDrive, LongLegsStayLevel) {
  const Geodetic from = Geodetic::from_degrees(55.8, 37.6, 100),
                 to = Geodetic::from_degrees(55.98, 37.6, 100);
  const Trajectory drive = Trajectory::from_waypoints(kStart, {Waypoint{from, 50}, Waypoint{to, 50}}, 2);
  for (const double share : {0.1, 0.5, 0.9}) {
    const Pose pose = drive.at(kStart + share * (drive.end() - drive.begin()));
    EXPECT_NEAR(pose.position.height_m, 100, 1e-3);
    EXPECT_NEAR(pose.position.longitude_rad, from.longitude_rad, 1e-8);
  }
}

// Coordinated turn: tan(bank) = v w / g; to the left, the left side goes down.
TEST(Attitude, BanksInTurns) {
  const Trajectory drive = corner();
  const GpsTime turning = kStart + 0.5 * (drive.end() - drive.begin());
  const double bank = std::atan(2 / kGravity);
  for (const Attitude attitude : {Attitude::Aircraft, Attitude::Multirotor}) {
    const Pose pose = drive.with_attitude(attitude).at(turning);
    EXPECT_NEAR(pose.roll_rad, -bank, 0.01);
    EXPECT_NEAR(pose.pitch_rad, 0, 0.01);
    // The top leans into the turn, to the left of north-east.
    EXPECT_NEAR(pose.up_enu().dot(Eigen::Vector3d(-1, 1, 0).normalized()), std::sin(bank), 0.01);
  }
  EXPECT_EQ(drive.at(turning).roll_rad, 0);
  // A multirotor that speeds up eastwards leans there: nose down.
  const Pose start = drive.with_attitude(Attitude::Multirotor).at(kStart + 2.0);
  EXPECT_NEAR(start.pitch_rad, -bank, 0.01);
  EXPECT_NEAR(start.up_enu().x(), std::sin(bank), 0.01);
  // An aircraft's nose points where it climbs: 45 deg.
  const Trajectory climb =
      Trajectory::from_waypoints(kStart, {Waypoint{at(0, 0)}, Waypoint{at(100, 0, 100)}}, 2);
  EXPECT_NEAR(climb.with_attitude(Attitude::Aircraft).at(kStart + 8.0).pitch_rad, geodesy::kPi / 4, 1e-3);
}

// The lever arm turns with the vehicle; the pattern counts elevations from its tilted horizon.
TEST(Attitude, TurnsTheAntenna) {
  Pose pose;
  pose.position = at(0, 0);
  pose.roll_rad = geodesy::radians(30);  // left side up, travel to the east
  const Pose antenna = mounted_antenna(pose, {0, 0, 2});
  const Eigen::Vector3d local = kFrame.local_from_geodetic(antenna.position);
  EXPECT_NEAR(local.y(), -1, 1e-6);  // up leans to the right: south
  EXPECT_NEAR(local.z(), std::sqrt(3.0), 1e-6);

  propagation::Arrival arrival;
  arrival.views.resize(1);
  arrival.views[0].paths.paths.resize(2);
  arrival.views[0].paths.paths[0].arrival = Eigen::Vector3d::UnitZ();
  arrival.views[0].paths.paths[1].arrival = -Eigen::Vector3d::UnitY();  // from the south, level
  tilt_antenna(arrival, pose, kFrame);
  EXPECT_NEAR(arrival.views[0].paths.paths[0].arrival_elevation_rad, geodesy::radians(60), 1e-9);
  EXPECT_NEAR(arrival.views[0].paths.paths[1].arrival_elevation_rad, geodesy::radians(30), 1e-9);
}

TEST(SmoothDrive, BadAccelerationsAreRefused) {
  for (const double bad : {0.0, -1.0, 101.0, std::nan("")}) {
    EXPECT_THAT(error_of([&] {
                  (void)Trajectory::from_waypoints(kStart, {Waypoint{at(0, 0)}, Waypoint{at(1, 0)}}, bad);
                }).what(),
                ::testing::HasSubstr("acceleration_mps2"));
  }
}

}  // namespace
}  // namespace canyon::simulation
