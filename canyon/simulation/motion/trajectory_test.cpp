#include "canyon/simulation/motion/trajectory.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "canyon/base/geodesy/constants.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::simulation::trajectory_test {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;
using test::error_of;
using ::testing::HasSubstr;

const GpsTime kStart = GpsTime::from_week(2051, 46701);
const Geodetic kPosition = Geodetic::from_degrees(22.3, 114.17, 5);

double distance_m(const Geodetic& a, const Geodetic& b) {
  return (geodesy::ecef_from_geodetic(a) - geodesy::ecef_from_geodetic(b)).norm();
}

// A circle of radius r at speed v in the tangent plane, one sample every `step_s`.
struct Circle {
  double r = 100;
  double v = 10;
  geodesy::LocalFrame frame{kPosition};

  [[nodiscard]] Eigen::Vector3d position(double t) const {
    return {r * std::cos(v / r * t), r * std::sin(v / r * t), 0};
  }
  [[nodiscard]] Eigen::Vector3d velocity(double t) const {
    return {-v * std::sin(v / r * t), v * std::cos(v / r * t), 0};
  }
  [[nodiscard]] Trajectory sampled(double step_s, int count) const {
    std::vector<std::pair<GpsTime, Geodetic>> samples;
    for (int i = 0; i < count; ++i) {
      samples.emplace_back(kStart + i * step_s, frame.geodetic_from_local(position(i * step_s)));
    }
    return Trajectory(samples);
  }
};

TEST(Trajectory, PassesThroughItsSamplesExactly) {
  const Circle circle;
  const Trajectory trajectory = circle.sampled(1, 50);
  for (int i = 0; i < 50; ++i) {
    const Geodetic expected = circle.frame.geodetic_from_local(circle.position(i));
    const Pose pose = trajectory.at(kStart + i);
    EXPECT_EQ(pose.position.latitude_rad, expected.latitude_rad);
    EXPECT_EQ(pose.position.longitude_rad, expected.longitude_rad);
    EXPECT_EQ(pose.position.height_m, expected.height_m);
  }
}

// Closed form: third derivative of a circle is v^3/r^2; bounds as documented in the header.
TEST(Trajectory, FollowsACircleWithinTheStatedBound) {
  const Circle circle;
  for (const double h : {0.5, 1.0, 2.0}) {
    const Trajectory trajectory = circle.sampled(h, 40);
    const double bound = 0.07 * std::pow(circle.v, 3) / std::pow(circle.r, 2) * h * h * h;
    double worst = 0;
    for (double t = 0; t <= 39 * h; t += 0.013) {
      const Pose pose = trajectory.at(kStart + t);
      worst = std::max(worst, (circle.frame.local_from_geodetic(pose.position) - circle.position(t)).norm());
    }
    EXPECT_LT(worst, bound) << "spacing " << h;
    EXPECT_GT(worst, bound / 50) << "the bound says nothing at spacing " << h;
  }
}

TEST(Trajectory, VelocityYawAndYawRateOfACircle) {
  const Circle circle;
  const Trajectory trajectory = circle.sampled(1, 40);
  for (double t = 3; t < 36; t += 0.17) {
    const Pose pose = trajectory.at(kStart + t);
    // The frame's vertical and the pose's differ by 100 m / 6400 km: 0.2 mm/s at 10 m/s.
    EXPECT_LT((pose.velocity_enu_mps - circle.velocity(t)).norm(), 0.03) << t;
    const double yaw = std::atan2(circle.velocity(t).y(), circle.velocity(t).x());
    EXPECT_NEAR(std::remainder(pose.yaw_rad - yaw, 2 * geodesy::kPi), 0, 0.003) << t;
    EXPECT_NEAR(pose.yaw_rate_radps, circle.v / circle.r, 0.01) << t;
  }
}

TEST(Trajectory, VelocityIsTheDerivativeOfPositionAndContinuous) {
  const Circle circle;
  const Trajectory trajectory = circle.sampled(1, 20);
  const geodesy::LocalFrame frame(kPosition);
  constexpr double d = 1e-4;
  Eigen::Vector3d previous = trajectory.at(kStart + 0.5).velocity_enu_mps;
  for (double t = 0.5; t < 18.5; t += 0.01) {
    const Eigen::Vector3d slope = (frame.local_from_geodetic(trajectory.at(kStart + (t + d)).position) -
                                   frame.local_from_geodetic(trajectory.at(kStart + (t - d)).position)) /
                                  (2 * d);
    const Eigen::Vector3d velocity = trajectory.at(kStart + t).velocity_enu_mps;
    EXPECT_LT((slope - velocity).norm(), 1e-3) << t;
    EXPECT_LT((velocity - previous).norm(), 0.02) << t;  // v^2/r * 0.01 s = 0.01 m/s
    previous = velocity;
  }
}

// East at constant speed with unequal spacings: the parabola through three samples is exact for a line.
TEST(Trajectory, UnevenSamplesOfAStraightDriveGiveItsSpeed) {
  const geodesy::LocalFrame frame(kPosition);
  std::vector<std::pair<GpsTime, Geodetic>> samples;
  for (const double t : {0.0, 0.2, 1.7, 2.0, 4.5, 4.6, 9.0}) {
    samples.emplace_back(kStart + t, frame.geodetic_from_local({12 * t, 0, 0}));
  }
  const Trajectory trajectory(samples);
  for (double t = 0; t <= 9; t += 0.1) {
    const Pose pose = trajectory.at(kStart + t);
    EXPECT_NEAR(pose.velocity_enu_mps.x(), 12, 1e-6);
    EXPECT_NEAR(frame.local_from_geodetic(pose.position).x(), 12 * t, 1e-6);
    EXPECT_NEAR(pose.yaw_rad, 0, 1e-4);
  }
}

TEST(Trajectory, BridgesLongGapsStraight) {
  const geodesy::LocalFrame frame(kPosition);
  // Northwards at 10 m/s, a gap of 10 s during which it moves 100 m east, then northwards again.
  std::vector<std::pair<GpsTime, Geodetic>> samples;
  for (int i = 0; i < 4; ++i) samples.emplace_back(kStart + i, frame.geodetic_from_local({0, 10.0 * i, 0}));
  for (int i = 0; i < 4; ++i)
    samples.emplace_back(kStart + 13 + i, frame.geodetic_from_local({100, 30 + 10.0 * i, 0}));
  const Trajectory trajectory(samples);
  for (double t = 3.5; t < 13; t += 0.5) {
    const Pose pose = trajectory.at(kStart + t);
    EXPECT_LT((frame.local_from_geodetic(pose.position) - Eigen::Vector3d(10 * (t - 3), 30, 0)).norm(), 2e-3);
    EXPECT_NEAR(pose.yaw_rad, 0, 1e-4);
    EXPECT_NEAR(pose.velocity_enu_mps.x(), 10, 1e-3);
  }
  EXPECT_NEAR(trajectory.at(kStart + 2.5).velocity_enu_mps.y(), 10, 1e-3);
  EXPECT_EQ(trajectory.sample_interval_s(), 1);
}

TEST(Trajectory, HoldsItsYawAtStandstill) {
  const geodesy::LocalFrame frame(kPosition);
  // Stationary for 5 s, drives to the south-west for 5 s, stationary for 5 s with a millimetre of jitter.
  std::vector<std::pair<GpsTime, Geodetic>> samples;
  const double step = 10 / std::sqrt(2.0);
  for (int i = 0; i <= 15; ++i) {
    const double s = -step * std::min(std::max(i - 5, 0), 5);
    const double jitter = i > 10 ? 0.001 * (i % 2) : 0;
    samples.emplace_back(kStart + i, frame.geodetic_from_local({s + jitter, s, 0}));
  }
  const Trajectory trajectory(samples);
  const double south_west = -0.75 * geodesy::kPi;
  for (const double t : {0.0, 1.3, 3.0, 7.0, 12.2, 13.7, 15.0}) {
    EXPECT_NEAR(trajectory.at(kStart + t).yaw_rad, south_west, 2e-4) << t;
  }
  EXPECT_EQ(trajectory.at(kStart + 13.7).yaw_rate_radps, 0);
}

TEST(Trajectory, ClampsBeyondItsEnds) {
  const Trajectory trajectory = Circle().sampled(1, 5);
  EXPECT_EQ(trajectory.at(kStart - 100.0).time, kStart);
  EXPECT_EQ(trajectory.at(kStart + 100.0).time, kStart + 4.0);
  EXPECT_EQ(trajectory.end(), kStart + 4.0);
}

TEST(Trajectory, WaypointsGiveStraightLegsAtConstantSpeed) {
  const geodesy::LocalFrame frame(kPosition);
  const std::vector<Waypoint> corners{{frame.geodetic_from_local({0, 0, 0}), 10, 2},
                                      {frame.geodetic_from_local({30, 0, 0}), 10, 2},
                                      {frame.geodetic_from_local({30, 40, 0}), 10, 2}};
  const Trajectory trajectory = Trajectory::from_waypoints(kStart, corners, std::nullopt);
  // hold 2, leg 3, hold 2, leg 4, hold 2
  EXPECT_NEAR(trajectory.end() - kStart, 13, 1e-6);
  EXPECT_NEAR(trajectory.length_m(), 70, 1e-6);
  EXPECT_EQ(trajectory.sample_interval_s(), 1);
  const auto at = [&](double t) { return frame.local_from_geodetic(trajectory.at(kStart + t).position); };
  EXPECT_LT((at(1) - Eigen::Vector3d(0, 0, 0)).norm(), 1e-6);
  EXPECT_LT((at(3.5) - Eigen::Vector3d(15, 0, 0)).norm(), 1e-3);
  EXPECT_LT((at(6) - Eigen::Vector3d(30, 0, 0)).norm(), 1e-6);
  EXPECT_LT((at(9) - Eigen::Vector3d(30, 20, 0)).norm(), 1e-3);
  EXPECT_NEAR(trajectory.at(kStart + 3.5).velocity_enu_mps.x(), 10, 1e-4);
  EXPECT_EQ(trajectory.at(kStart + 6.0).velocity_enu_mps.norm(), 0);
  EXPECT_NEAR(trajectory.at(kStart + 6.0).yaw_rad, 0, 1e-5)
      << "standing at the corner it looks along the first leg";
  EXPECT_NEAR(trajectory.at(kStart + 9.0).yaw_rad, geodesy::kPi / 2, 1e-5);
}

TEST(Trajectory, LongLegsStayAboveTheEllipsoid) {
  // 1 degree of longitude at the equator: a chord of 111 km is 240 m lower in the middle.
  const Trajectory trajectory = Trajectory::from_waypoints(
      kStart,
      {Waypoint{Geodetic::from_degrees(0, 10, 100), 100}, Waypoint{Geodetic::from_degrees(0, 11, 300), 100}},
      std::nullopt);
  const GpsTime middle = kStart + (trajectory.end() - kStart) / 2;
  EXPECT_NEAR(trajectory.at(middle).position.height_m, 200, 1e-6);
  // Half of the chord between different heights is 0.9 m from half of the angle.
  EXPECT_NEAR(geodesy::degrees(trajectory.at(middle).position.longitude_rad), 10.5, 1e-5);
  EXPECT_NEAR(trajectory.at(middle).velocity_enu_mps.x(), 100, 0.01);
}

TEST(Trajectory, AFixedPlaceStands) {
  const Trajectory trajectory = Trajectory::fixed(kStart, kPosition, 60);
  EXPECT_EQ(trajectory.end(), kStart + 60.0);
  EXPECT_EQ(distance_m(trajectory.at(kStart + 30.0).position, kPosition), 0);
  EXPECT_EQ(trajectory.at(kStart + 30.0).velocity_enu_mps.norm(), 0);
  EXPECT_EQ(trajectory.length_m(), 0);
  EXPECT_EQ(Trajectory::fixed(kStart, kPosition, 0).end(), kStart);
}

TEST(Trajectory, RefusesBadSamples) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(error_of([] { Trajectory t({}); }).what(), HasSubstr("empty"));
  EXPECT_THAT(error_of([] {
                Trajectory t({{kStart, kPosition}, {kStart, kPosition}});
              }).what(),
              HasSubstr("does not follow"));
  EXPECT_THAT(error_of([&] { Trajectory t({{kStart, {nan, 0, 0}}}); }).what(), HasSubstr("latitude"));
  EXPECT_THAT(error_of([] {
                (void)Trajectory::from_waypoints(kStart, {Waypoint{kPosition, 0}, Waypoint{kPosition, 0}},
                                                 std::nullopt);
              }).what(),
              HasSubstr("speed_mps"));
  EXPECT_THAT(error_of([&] {
                (void)Trajectory::from_waypoints(kStart, {Waypoint{kPosition, nan}}, std::nullopt);
              }).what(),
              HasSubstr("speed_mps"));
  EXPECT_THAT(error_of([&] {
                (void)Trajectory::from_waypoints(kStart, {Waypoint{kPosition, 1, -1}}, std::nullopt);
              }).what(),
              HasSubstr("hold_s"));
  EXPECT_THAT(error_of([&] { (void)Trajectory::fixed(kStart, kPosition, nan); }).what(),
              HasSubstr("duration_s"));
}

}  // namespace
}  // namespace canyon::simulation::trajectory_test
