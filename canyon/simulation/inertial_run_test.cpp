#include "canyon/simulation/motion/smooth_motion.hpp"
#include "canyon/simulation/sensor_run.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::simulation {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using geodesy::Geodetic;
using geodesy::GpsTime;

const GpsTime kBegin = GpsTime::from_week(2400, 100);

/// Strapdown integration in latitude, longitude, height and the local north-east-down frame (Titterton and
/// Weston, Strapdown Inertial Navigation Technology, 2nd ed., 3.7 and 11.2), from increments of a sensor with
/// forward-right-down axes: a separate algorithm, with Somigliana's gravity by its series in the height.
class Mechanisation {
 public:
  Mechanisation(const inertial::ImuState& state) {
    position = geodesy::geodetic_from_ecef(state.sensor.position_m);
    const Matrix3d ned_from_ecef = ned() * geodesy::enu_from_ecef_rotation(position);
    velocity = ned_from_ecef * state.sensor.velocity_mps;
    attitude = Quaterniond(ned_from_ecef * state.sensor.ecef_from_body);
  }

  void add(const inertial::ImuInput& mean, double dt) {
    const Vector3d rotation_angle = mean.angular_rate_radps * dt, push = mean.specific_force_mps2 * dt;
    // Rotation during the step to the second order; sculling and coning by the previous increments (Savage
    // 1998).
    const Vector3d push_in_body = push + 0.5 * rotation_angle.cross(push) +
                                  rotation_angle.cross(rotation_angle.cross(push)) / 6 +
                                  (previous_rotation_.cross(push) + last_push_.cross(rotation_angle)) / 12;
    const Vector3d rotation_with_coning = rotation_angle + previous_rotation_.cross(rotation_angle) / 12;
    // Rates at the middle of the step, from its start: velocity and position change little.
    const double middle_latitude =
        position.latitude_rad + velocity.x() / (meridian() + position.height_m) * dt / 2;
    const Vector3d middle_velocity = velocity + last_acceleration_ * dt / 2;
    const Vector3d earth =
        geodesy::kEarthRotationRate * Vector3d(std::cos(middle_latitude), 0, -std::sin(middle_latitude));
    const double east_radius = normal() + position.height_m;
    const Vector3d transport(middle_velocity.y() / east_radius,
                             -middle_velocity.x() / (meridian() + position.height_m),
                             -middle_velocity.y() * std::tan(middle_latitude) / east_radius);
    const Vector3d frame_rotation = (earth + transport) * dt;
    const Vector3d change = rotation(-0.5 * frame_rotation) * (attitude * push_in_body) +
                            dt * (gravity() - (2 * earth + transport).cross(middle_velocity));
    const Vector3d mean_velocity = velocity + change / 2;
    velocity += change;
    last_acceleration_ = change / dt;
    position.height_m -= mean_velocity.z() * dt;
    const double before = position.latitude_rad;
    position.latitude_rad += mean_velocity.x() / (meridian() + position.height_m) * dt;
    position.longitude_rad +=
        mean_velocity.y() /
        ((normal() + position.height_m) * std::cos((before + position.latitude_rad) / 2)) * dt;
    attitude =
        (Quaterniond(rotation(-frame_rotation)) * attitude * Quaterniond(rotation(rotation_with_coning)))
            .normalized();
    previous_rotation_ = rotation_angle;
    last_push_ = push;
  }

  static Matrix3d ned() { return (Matrix3d() << 0, 1, 0, 1, 0, 0, 0, 0, -1).finished(); }

  Geodetic position;
  Vector3d velocity;
  Quaterniond attitude;

 private:
  static constexpr double kA = 6378137, kE2 = 0.00669437999014;
  static Matrix3d rotation(const Vector3d& rotation_angle) {
    const double angle = rotation_angle.norm();
    return angle > 0 ? Eigen::AngleAxisd(angle, rotation_angle / angle).toRotationMatrix()
                     : Matrix3d::Identity();
  }
  [[nodiscard]] double meridian() const {
    return kA * (1 - kE2) / std::pow(1 - kE2 * std::pow(std::sin(position.latitude_rad), 2), 1.5);
  }
  [[nodiscard]] double normal() const {
    return kA / std::sqrt(1 - kE2 * std::pow(std::sin(position.latitude_rad), 2));
  }
  [[nodiscard]] Vector3d gravity() const {
    const double s = std::pow(std::sin(position.latitude_rad), 2), h = position.height_m;
    constexpr double f = 1 / 298.257223563, m = 0.00344978650684;
    const double level = 9.7803253359 * (1 + 0.00193185265241 * s) / std::sqrt(1 - kE2 * s);
    const double down = level * (1 - 2 / kA * (1 + f + m - 2 * f * s) * h + 3 / (kA * kA) * h * h);
    return {-8.08e-9 * h * std::sin(2 * position.latitude_rad), 0, down};
  }

  Vector3d previous_rotation_ = Vector3d::Zero(), last_push_ = Vector3d::Zero(),
           last_acceleration_ = Vector3d::Zero();
};

struct Drift {
  double position_m = 0, velocity_mps = 0, attitude_deg = 0;
};

/// Integrates the samples of an error-free sensor over a trajectory, and compares at its end.
Drift drift_of(const Trajectory& trajectory, double max_s, double rate_hz = 200) {
  inertial::ImuOptions options;
  options.profile = inertial::ImuProfile::Ideal;
  options.rate_hz = rate_hz;
  options.axes = inertial::ImuAxes::Frd;
  options.position_m = {0.8, -0.3, 0.4};
  InertialRun run(options, 1, trajectory.begin(), [&](GpsTime t) { return trajectory.ecef_pose(t); });
  inertial::IdealImu first(
      options, [&](double t) { return body_state(trajectory.at(trajectory.begin() + t)); }, 0.0025);
  Mechanisation mechanisation(first.at(0));
  Drift drift;
  const GpsTime end = std::min(trajectory.end(), trajectory.begin() + max_s);
  while (const auto sample = run.next(end)) {
    mechanisation.add(sample->mean, 1 / rate_hz);
    const Geodetic position = geodesy::geodetic_from_ecef(sample->truth.sensor.position_m);
    const Matrix3d ned_from_ecef = Mechanisation::ned() * geodesy::enu_from_ecef_rotation(position);
    const double apart_m =
        (geodesy::ecef_from_geodetic(mechanisation.position) - sample->truth.sensor.position_m).norm();
    drift.position_m = std::max(drift.position_m, apart_m);
    drift.velocity_mps =
        std::max(drift.velocity_mps,
                 (ned_from_ecef * sample->truth.sensor.velocity_mps - mechanisation.velocity).norm());
    const Quaterniond truth(Matrix3d(ned_from_ecef * sample->truth.sensor.ecef_from_body));
    drift.attitude_deg =
        std::max(drift.attitude_deg, geodesy::degrees(truth.angularDistance(mechanisation.attitude)));
  }
  return drift;
}

/// Ten minutes around blocks of a town, with holds, at street level.
Trajectory street(const Geodetic& origin) {
  const geodesy::LocalFrame frame(origin);
  std::vector<Waypoint> waypoints;
  for (int lap = 0; lap < 12; ++lap) {
    waypoints.push_back({frame.geodetic_from_local({0, 0, 1}), 10, lap % 3 == 1 ? 8.0 : 0.0});
    waypoints.push_back({frame.geodetic_from_local({150, 0, 3}), 12});
    waypoints.push_back({frame.geodetic_from_local({150, 120, 4}), 8});
    waypoints.push_back({frame.geodetic_from_local({0, 120, 1}), 14});
  }
  return Trajectory::from_waypoints(kBegin, waypoints, 2);
}

// The drift of an error-free sensor is that of the two algorithms: ten minutes, a street in the north and a
// drone's flight with bank in the south.
TEST(InertialRun, IntegratesToTheTruth) {
  const Drift car = drift_of(street(Geodetic::from_degrees(55.8, 37.6, 150)), 600);
  EXPECT_LT(car.position_m, 0.01);
  EXPECT_LT(car.velocity_mps, 1e-4);
  EXPECT_LT(car.attitude_deg, 1e-3);
  const geodesy::LocalFrame frame(Geodetic::from_degrees(-33.9, 151.2, 20));
  const auto flight = [&](bool upright) {
    std::vector<Waypoint> waypoints;
    for (int lap = 0; lap < 12; ++lap) {
      waypoints.push_back({frame.geodetic_from_local({0, 0, 30}), 10});
      if (upright) waypoints.push_back({frame.geodetic_from_local({0, 0, 60}), 4});
      waypoints.push_back({frame.geodetic_from_local({250, 80, 80}), 15, upright ? 3.0 : 0.0});
      waypoints.push_back({frame.geodetic_from_local({100, 300, 50}), 15});
    }
    return Trajectory::from_waypoints(kBegin, waypoints, 4).with_attitude(Attitude::Multirotor);
  };
  // Between upright and level flight a multirotor rotates so fast that 200 Hz are too slow to integrate it to
  // a centimetre (6 cm); 1 kHz is enough.
  for (const Drift& drone : {drift_of(flight(false), 600), drift_of(flight(true), 600, 1000)}) {
    EXPECT_LT(drone.position_m, 0.01);
    EXPECT_LT(drone.velocity_mps, 1e-4);
    EXPECT_LT(drone.attitude_deg, 1e-3);
    RecordProperty("drone_mm", static_cast<int>(drone.position_m * 1e3));
  }
}

std::string scenario_text(const std::string& trajectory, const std::string& imu) {
  return "city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17, height_m: 5}}\n"
         "start: 2026-06-01T06:00:00Z\nduration_s: 8\ntrajectory: " +
         trajectory + "\nsensors: {imu: {" + imu + "}}\n";
}
const char* const kRoute = "waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 90, north_m: 0, up_m: 2}]";

// The direct computation of ECEF agrees with that via geodetic coordinates.
TEST(InertialRun, EcefPosesAreThoseOfTheTrajectory) {
  for (const Attitude attitude : {Attitude::Level, Attitude::Car, Attitude::Multirotor}) {
    const Trajectory trajectory = street(Geodetic::from_degrees(-77.8, 166.7, 2500)).with_attitude(attitude);
    for (double t = 0; t < 100; t += 0.73) {
      const auto rigid = trajectory.ecef_pose(kBegin + t);
      const inertial::BodyState by_pose = body_state(trajectory.at(kBegin + t));
      EXPECT_LT((rigid.position_m - by_pose.position_m).norm(), 1e-8);
      EXPECT_LT((rigid.velocity_mps - by_pose.velocity_mps).norm(), 1e-9);
      EXPECT_LT((rigid.acceleration_mps2 - by_pose.acceleration_mps2).norm(), 1e-9);
      EXPECT_LT((rigid.ecef_from_body - by_pose.ecef_from_body).norm(), 1e-9);
    }
  }
  const Geodetic position = Geodetic::from_degrees(1, 2, 3);
  EXPECT_EQ(Trajectory::fixed(kBegin, position, 10).ecef_pose(kBegin).position_m,
            geodesy::ecef_from_geodetic(position));
}

TEST(InertialRun, NeedsASmoothMotion) {
  const auto simulate = [](const std::string& trajectory) {
    const Scenario scenario = parse_scenario(scenario_text(trajectory, "rate_hz: 50"), "s.yaml");
    city::City city;
    city.frame = geodesy::LocalFrame(Geodetic::from_degrees(22.3, 114.17, 5));
    return Simulation(scenario, city);
  };
  EXPECT_THAT(canyon::test::refusal([&] { (void)simulate(std::string("{") + kRoute + "}"); }),
              ::testing::AllOf(::testing::HasSubstr("changes its speed and direction instantly"),
                               ::testing::HasSubstr("trajectory.acceleration_mps2")));
  EXPECT_TRUE(simulate(std::string("{") + kRoute + ", acceleration_mps2: 2}").trajectory().smooth());
  // On the ground of an open field, which is level at the origin's height.
  const Simulation clamped =
      simulate(std::string("{") + kRoute + ", acceleration_mps2: 2, height_above_terrain_m: 1.5}");
  EXPECT_TRUE(clamped.trajectory().smooth());
  EXPECT_NEAR(clamped.vehicle_pose(clamped.begin() + 4.0).position.height_m, 6.5, 0.01);
  EXPECT_THAT(clamped.warnings(),
              ::testing::Contains(::testing::HasSubstr(
                  "the trajectory is smoothed over about a second: shifted by up to 0.1")));
}

// A circle of 20 m to the left at 5 m/s: the wheels run on circles of 20 m less and more half the track.
TEST(WheelRun, WheelsOfATurnDiffer) {
  inertial::WheelOptions options;
  options.scale = options.slip = options.tick_m = 0;
  options.track_m = 1.6;
  const Geodetic geodetic = Geodetic::from_degrees(50, 8, 100);
  WheelRun run(options, 1, kBegin, [&](GpsTime t) {
    Pose pose;
    pose.position = geodetic;
    pose.yaw_rad = 0.25 * (t - kBegin);
    pose.yaw_rate_radps = 0.25;
    pose.velocity_enu_mps = 5 * Vector3d(std::cos(pose.yaw_rad), std::sin(pose.yaw_rad), 0);
    return pose;
  });
  const auto sample = run.next(kBegin + 0.1);
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->time, kBegin + 0.1);
  EXPECT_NEAR(sample->sample.speed_mps[0], 5 * 19.2 / 20, 1e-9);
  EXPECT_NEAR(sample->sample.speed_mps[1], 5 * 20.8 / 20, 1e-9);
  EXPECT_FALSE(run.next(kBegin + 0.19));
}

TEST(WheelRun, WheelsSlip) {
  inertial::WheelOptions options;
  options.scale = options.slip = options.tick_m = 0;
  options.slips = {{0.1, 0.3, 3}};
  WheelRun run(options, 1, kBegin, [&](GpsTime) {
    Pose pose;
    pose.position = Geodetic::from_degrees(50, 8, 100);
    pose.velocity_enu_mps = {5, 0, 0};
    return pose;
  });
  for (const double factor : {1, 3, 3, 1})
    EXPECT_NEAR(run.next(kBegin + 9)->sample.speed_mps[0], 5 * factor, 1e-9);
}

TEST(InertialRun, OptionsAreChecked) {
  const auto refusal = [](const std::string& imu) {
    return canyon::test::refusal(
        [&] { (void)parse_scenario(scenario_text(std::string("{") + kRoute + "}", imu), "s.yaml"); });
  };
  EXPECT_THAT(refusal("rate_hz: 20000"), ::testing::HasSubstr("rate_hz"));
  EXPECT_THAT(refusal("profile: naval"), ::testing::HasSubstr("tactical"));
  EXPECT_THAT(refusal("}, wheels: {slip: -1"), ::testing::HasSubstr("slip"));
  EXPECT_THAT(refusal("}, wheels: {tick: 1"), ::testing::HasSubstr("tick_m"));
  EXPECT_THAT(refusal("gyroscope: {bias_instability_deg_h: -1}"),
              ::testing::HasSubstr("bias_instability_deg_h"));
  EXPECT_EQ(refusal("gyroscope: {range_deg_s: none}, accelerometer: {turn_on_bias_mg: 3}"), "");
}

}  // namespace
}  // namespace canyon::simulation
