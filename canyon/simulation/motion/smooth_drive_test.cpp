#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/simulation/motion/antenna_pose.hpp"
#include "canyon/simulation/motion/smooth_drive.hpp"
#include "canyon/simulation/motion/smooth_motion.hpp"
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

/// The means of a segment extend this far beyond its `route`, at its begin and at its end.
constexpr double kReach = SmoothMotion::kReach_s;

// 100 m at 10 m/s and 2 m/s^2: 5 s and 25 m to speed up, as much to stop, 50 m between; 15 s.
TEST(SmoothDrive, SpeedsUpAndStops) {
  const Trajectory drive = Trajectory::from_waypoints(kStart, {Waypoint{at(0, 0)}, Waypoint{at(100, 0)}}, 2);
  EXPECT_NEAR(drive.end() - drive.begin(), 15 + 2 * kReach, 1e-4);
  EXPECT_NEAR(drive.length_m(), 100, 1e-3);
  EXPECT_TRUE(drive.smooth());
  const GpsTime moves = kStart + kReach;
  // A mean with variance s of a t^2 / 2 is a (t^2 + s) / 2.
  EXPECT_NEAR(east(drive.at(moves + 2.5)), 6.25 + SmoothMotion::kVariance_s2, 1e-6);
  EXPECT_NEAR(east(drive.at(moves + 7.5)), 50, 1e-6);
  EXPECT_NEAR(drive.at(moves + 2.0).velocity_enu_mps.x(), 4, 1e-5);
  EXPECT_NEAR(drive.at(moves + 2.0).acceleration_enu_mps2.x(), 2, 1e-5);
  EXPECT_NEAR(drive.at(moves + 7.5).velocity_enu_mps.x(), 10, 1e-4);
  EXPECT_EQ(drive.at(kStart).velocity_enu_mps.norm(), 0);
  EXPECT_NEAR(drive.at(drive.end()).velocity_enu_mps.norm(), 0, 1e-12);
  EXPECT_NEAR(east(drive.at(drive.end())), 100, 1e-6);
  // Too short to reach its speed: 2 sqrt(d / a).
  const Trajectory hop = Trajectory::from_waypoints(kStart, {Waypoint{at(0, 0)}, Waypoint{at(8, 0)}}, 2);
  EXPECT_NEAR(hop.end() - hop.begin(), 4 + 2 * kReach, 1e-4);
}

// A right angle between legs of 100 m at 10 m/s and 2 m/s^2 needs a radius of 50 m, whose arc would begin 50
// m before the corner; 45 % of the leg allow 45 m, driven at sqrt(2 * 45).
Trajectory corner() {
  return Trajectory::from_waypoints(kStart,
                                    {Waypoint{at(0, 0)}, Waypoint{at(100, 0)}, Waypoint{at(100, 100)}}, 2);
}

TEST(SmoothDrive, TurnsWithinTheAcceleration) {
  const Trajectory drive = corner();
  const double v = std::sqrt(90.0), arc_s = geodesy::kPi / 2 * 45 / v;
  // Each straight part of 55 m: up to the top speed and down to v (or the reverse).
  const double top = std::min(10.0, std::sqrt(2 * 55 + v * v / 2));
  const double cruise_m = 55 - top * top / 4 - (top * top - v * v) / 4;
  const double straight_s = top / 2 + (top - v) / 2 + cruise_m / top;
  EXPECT_NEAR(drive.end() - drive.begin(), 2 * (straight_s + kReach) + arc_s, 1e-3);
  const Pose middle = drive.at(kStart + kReach + straight_s + arc_s / 2);
  // The mean of a circle is a circle that is smaller by the factor 1 - w^2 variance / 2.
  EXPECT_NEAR(middle.yaw_rate_radps, v / 45, 1e-5);
  EXPECT_NEAR(middle.velocity_enu_mps.norm(), v * (1 - v * v / 2025 * SmoothMotion::kVariance_s2 / 2), 1e-3);
  EXPECT_NEAR(middle.yaw_rad, geodesy::kPi / 4, 1e-4);
}

/// The largest speed, acceleration and jerk of a drive, and how much its derivatives differ from differences.
struct Extremes {
  double speed = 0, acceleration = 0, jerk = 0;
  double velocity_error = 0, acceleration_error = 0, yaw_rate_error = 0;
};
Extremes extremes_of(const Trajectory& drive) {
  Extremes maximum;
  constexpr double kStep = 0.004;
  const geodesy::LocalFrame frame(drive.at(drive.begin()).position);
  const auto local = [&](const Pose& pose, const Eigen::Vector3d& enu) -> Eigen::Vector3d {
    return frame.ecef_from_local_rotation().transpose() *
           (geodesy::enu_from_ecef_rotation(pose.position).transpose() * enu);
  };
  for (double t = 0; t + 2 * kStep < drive.end() - drive.begin(); t += 0.037) {
    const Pose a = drive.at(kStart + t), b = drive.at(kStart + (t + kStep)),
               c = drive.at(kStart + (t + 2 * kStep));
    const Eigen::Vector3d v = local(b, b.velocity_enu_mps), u = local(b, b.acceleration_enu_mps2);
    maximum.speed = std::max(maximum.speed, v.norm());
    maximum.acceleration = std::max(maximum.acceleration, u.norm());
    maximum.jerk = std::max(
        maximum.jerk,
        (local(c, c.acceleration_enu_mps2) - local(a, a.acceleration_enu_mps2)).norm() / (2 * kStep));
    const Eigen::Vector3d moved =
        frame.local_from_geodetic(c.position) - frame.local_from_geodetic(a.position);
    maximum.velocity_error = std::max(maximum.velocity_error, (moved / (2 * kStep) - v).norm());
    maximum.acceleration_error =
        std::max(maximum.acceleration_error,
                 ((local(c, c.velocity_enu_mps) - local(a, a.velocity_enu_mps)) / (2 * kStep) - u).norm());
    maximum.yaw_rate_error = std::max(
        maximum.yaw_rate_error,
        std::abs(std::remainder(c.yaw_rad - a.yaw_rad, 2 * geodesy::kPi) / (2 * kStep) - b.yaw_rate_radps));
  }
  return maximum;
}

// Sharp and blunt corners, a short leg, a hold, a return, climbs and other speeds: no limit is exceeded, and
// velocity, acceleration and yaw rate are derivatives of one motion.
TEST(SmoothDrive, KeepsItsLimits) {
  const Trajectory drive = Trajectory::from_waypoints(
      kStart,
      {Waypoint{at(0, 0)}, Waypoint{at(100, 0)}, Waypoint{at(103, 40)}, Waypoint{at(104, 44), 20},
       Waypoint{at(150, -20, 15), 12, 6}, Waypoint{at(60, -60, 15), 8}, Waypoint{at(150, -20, 15), 14},
       Waypoint{at(150, -20, 60), 3}, Waypoint{at(400, 200, 40), 14}},
      2);
  const Extremes maximum = extremes_of(drive);
  EXPECT_LE(maximum.speed, 14 + 1e-4);
  EXPECT_GT(maximum.speed, 13.9);
  EXPECT_LE(maximum.acceleration, 2 + 1e-4);
  EXPECT_GT(maximum.acceleration, 1.95);
  EXPECT_LE(maximum.jerk, 2 * 2 / SmoothMotion::kBox_s + 1e-3);
  // Bounds for central differences over 4 ms.
  EXPECT_LT(maximum.velocity_error, 2e-5);
  EXPECT_LT(maximum.acceleration_error, 2e-4);
  EXPECT_LT(maximum.yaw_rate_error, 2e-4);
}

// The vehicle rests during a hold; it also stops at a return, and rotates there.
TEST(SmoothDrive, HoldsAreReached) {
  const Trajectory drive = Trajectory::from_waypoints(
      kStart, {Waypoint{at(0, 0)}, Waypoint{at(100, 0), 10, 20}, Waypoint{at(100, 100), 5}}, 2);
  const double is_stationary = 15 + 2 * kReach;
  for (const double t : {0.0, 10.0, 20.0}) {
    EXPECT_NEAR(east(drive.at(kStart + (is_stationary + t))), 100, 1e-6);
    EXPECT_LT(drive.at(kStart + (is_stationary + t)).velocity_enu_mps.norm(), 1e-9);
  }
  EXPECT_NEAR(drive.at(kStart + is_stationary).yaw_rad, 0, 1e-6);
  // A quarter turn at 1 rad/s; then 100 m at 5 m/s: 2.5 s and 6.25 m twice, 87.5 m between.
  const double rotation_s = geodesy::kPi / 2;
  EXPECT_NEAR(drive.at(kStart + (is_stationary + 20 + kReach + rotation_s + 3)).yaw_rad, geodesy::kPi / 2,
              1e-4);
  EXPECT_NEAR(drive.end() - drive.begin(), is_stationary + 20 + rotation_s + 2 * kReach + 2 * 2.5 + 17.5,
              1e-3);
  const Trajectory back =
      Trajectory::from_waypoints(kStart, {Waypoint{at(0, 0)}, Waypoint{at(100, 0)}, Waypoint{at(0, 0)}}, 2);
  EXPECT_NEAR(back.end() - back.begin(), 30 + 4 * kReach + geodesy::kPi, 1e-3);
}

// A hold of a month costs no control points.
TEST(SmoothDrive, LongHoldsAreCheap) {
  const Trajectory drive =
      Trajectory::from_waypoints(kStart, {Waypoint{at(0, 0), 10, 2.6e6}, Waypoint{at(100, 0)}}, 2);
  EXPECT_NEAR(drive.end() - drive.begin(), 2.6e6 + 15 + 2 * kReach, 1e-3);
  EXPECT_NEAR(east(drive.at(drive.end() + (-7.5 - kReach))), 50, 1e-5);
}

// Samples of a circle at 1 Hz with a corner in it: the smooth path is as close as documented, and its
// derivatives are consistent.
TEST(SmoothMotion, SmoothsARecordedPath) {
  std::vector<std::pair<GpsTime, Geodetic>> samples;
  for (int k = 0; k <= 60; ++k)
    samples.emplace_back(kStart + static_cast<double>(k), at(50 * std::cos(0.1 * k), 50 * std::sin(0.1 * k)));
  const Trajectory recorded(samples);
  EXPECT_FALSE(recorded.smooth());
  const Trajectory smooth = recorded.smoothed([&](GpsTime t) { return recorded.at(t); });
  EXPECT_TRUE(smooth.smooth());
  EXPECT_EQ(smooth.begin(), recorded.begin());
  EXPECT_EQ(smooth.end(), recorded.end());
  // v = 5 m/s, a = 0.5 m/s^2.
  for (double t = 1.5; t < 58.5; t += 0.31) {
    const Pose a = recorded.at(kStart + t), b = smooth.at(kStart + t);
    const double apart =
        (kFrame.local_from_geodetic(a.position) - kFrame.local_from_geodetic(b.position)).norm();
    EXPECT_LT(apart, 1.2 * SmoothMotion::kVariance_s2 / 2 * 0.5) << t;
    EXPECT_NEAR(b.yaw_rate_radps, 0.1, 0.003) << t;
  }
  const Extremes maximum = extremes_of(smooth);
  EXPECT_LT(maximum.velocity_error, 1e-5);
  EXPECT_LT(maximum.acceleration_error, 1e-4);
  EXPECT_LT(maximum.yaw_rate_error, 1e-4);
}

// A level route of 20 km stays level over the ellipsoid, although its chord is 8 m below.
TEST(SmoothDrive, LongLegsStayLevel) {
  const Geodetic from = Geodetic::from_degrees(55.8, 37.6, 100),
                 to = Geodetic::from_degrees(55.98, 37.6, 100);
  const Trajectory drive = Trajectory::from_waypoints(kStart, {Waypoint{from, 50}, Waypoint{to, 50}}, 2);
  for (const double fraction : {0.1, 0.5, 0.9}) {
    const Pose pose = drive.at(kStart + fraction * (drive.end() - drive.begin()));
    EXPECT_NEAR(pose.position.height_m, 100, 1e-3);
    EXPECT_NEAR(pose.position.longitude_rad, from.longitude_rad, 1e-8);
  }
}

// Coordinated turn: tan(bank) = v w / g; to the left, the left side goes down.
TEST(Attitude, BanksInTurns) {
  const Trajectory drive = corner();
  const GpsTime rotation_rate = kStart + 0.5 * (drive.end() - drive.begin());
  const double bank = std::atan(2 / kGravity);
  for (const Attitude attitude : {Attitude::Aircraft, Attitude::Multirotor}) {
    const Pose pose = drive.with_attitude(attitude).at(rotation_rate);
    EXPECT_NEAR(pose.roll_rad, -bank, 0.01);
    EXPECT_NEAR(pose.pitch_rad, 0, 0.01);
    // The top leans into the bend, to the left of north-east.
    EXPECT_NEAR(pose.up_enu().dot(Eigen::Vector3d(-1, 1, 0).normalized()), std::sin(bank), 0.01);
  }
  EXPECT_EQ(drive.at(rotation_rate).roll_rad, 0);
  // A multirotor that accelerates eastwards leans there: nose down.
  const Pose start = drive.with_attitude(Attitude::Multirotor).at(kStart + (2.0 + kReach));
  EXPECT_NEAR(start.pitch_rad, -bank, 0.01);
  EXPECT_NEAR(start.up_enu().x(), std::sin(bank), 0.01);
  // An aircraft's nose points along its climb: 45 deg.
  const Trajectory climb =
      Trajectory::from_waypoints(kStart, {Waypoint{at(0, 0)}, Waypoint{at(100, 0, 100)}}, 2);
  EXPECT_NEAR(climb.with_attitude(Attitude::Aircraft).at(kStart + 8.0).pitch_rad, geodesy::kPi / 4, 1e-3);
}

// The lever arm rotates with the vehicle; the pattern counts elevations from its tilted horizon.
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
