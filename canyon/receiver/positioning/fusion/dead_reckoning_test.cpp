#include "canyon/receiver/positioning/fusion/dead_reckoning.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <limits>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/random.hpp"
#include "canyon/receiver/positioning/fusion/vehicle_constraints.hpp"

namespace canyon::positioning {
namespace {

using Eigen::Vector3d;
using geodesy::GpsTime;

const GpsTime kBegin = GpsTime::from_week(2400, 1000);
const geodesy::Geodetic kHome = geodesy::Geodetic::from_degrees(22.3, 114.17, 30);
constexpr double kImu_s = 0.01, kEpoch_s = 0.2, kWheel_s = 0.1;

/// A drive on the level plane at kHome: rest, then eastwards with bends, each at 1 m/s^2 or less. Over half a
/// kilometre the plane differs from the ellipsoid by 2 cm.
struct Plane {
  [[nodiscard]] double speed(double t) const { return t < 10 ? 0 : t < 20 ? t - 10 : 10; }
  [[nodiscard]] double yaw_rate(double t) const { return t > 30 ? 0.1 * std::sin(0.2 * (t - 30)) : 0; }
};

/// Readings of error-free sensors on the plane, and their positions.
class Drive {
 public:
  /// @param bias of the gyroscope about the up axis [rad/s]; @param scale of the wheels
  explicit Drive(double bias = 0, double scale = 0) : bias_(bias), scale_(scale) {
    mounting.imu_interval_s = kImu_s;
    mounting.gyroscope = {1e-5, 1e-6, 0, 2e-3, 1e-4, 1e-4};
    mounting.accelerometer = {1e-4, 1e-5, 0, 1e-2, 1e-4, 1e-4};
    mounting.antenna_m = {0.5, 0, 1};
    mounting.axle_m = {0, 0, -0.5};
    mounting.wheels = WheelModel{10, 0.01, 0.001, 1, 0, true};
  }

  /// The readings up to the time of the next epoch, and the true position of the antenna then.
  SensorReadings next() {
    SensorReadings readings;
    const Eigen::Matrix3d ecef_from_enu = geodesy::enu_from_ecef_rotation(kHome).transpose();
    const Vector3d gravity = geodesy::normal_gravity(geodesy::ecef_from_geodetic(kHome));
    const Vector3d earth(0, 0, geodesy::kEarthRotationRate);
    for (int k = 0; k < static_cast<int>(std::lround(kEpoch_s / kImu_s)); ++k) {
      const double before_mps = plane.speed(t_s), rate = plane.yaw_rate(t_s + kImu_s / 2);
      t_s += kImu_s;
      const double push = (plane.speed(t_s) - before_mps) / kImu_s;
      const double middle = (before_mps + plane.speed(t_s)) / 2;
      const double middle_yaw = yaw_rad + rate * kImu_s / 2;
      enu_m += middle * kImu_s * Vector3d(std::cos(middle_yaw), std::sin(middle_yaw), 0);
      yaw_rad += rate * kImu_s;
      const Eigen::Matrix3d ecef_from_body =
          ecef_from_enu * Eigen::AngleAxisd(middle_yaw, Vector3d::UnitZ()).toRotationMatrix();
      const Vector3d velocity = middle * ecef_from_body.col(0);
      ImuReading reading;
      reading.time = kBegin + t_s;
      reading.specific_force_mps2 = Vector3d(push, rate * middle, 0) +
                                    ecef_from_body.transpose() * (2 * earth.cross(velocity) - gravity);
      reading.angular_rate_radps = Vector3d(0, 0, rate + bias_) + ecef_from_body.transpose() * earth;
      readings.imu.push_back(reading);
      travelled_m_ += middle * kImu_s;
      if (std::fmod(t_s + 1e-9, kWheel_s) < kImu_s / 2) {
        readings.wheels.push_back({kBegin + t_s, kWheel_s, (1 + scale_) * travelled_m_ / kWheel_s});
        travelled_m_ = 0;
      }
    }
    return readings;
  }

  [[nodiscard]] Vector3d antenna_ecef() const {
    const Eigen::Matrix3d ecef_from_enu = geodesy::enu_from_ecef_rotation(kHome).transpose();
    return geodesy::ecef_from_geodetic(kHome) +
           ecef_from_enu * (enu_m + Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()) * mounting.antenna_m);
  }
  /// A fix of 1 m and 0.05 m/s, off by `error_enu_m`.
  [[nodiscard]] Fix fix(const Vector3d& error_enu_m = Vector3d::Zero()) const {
    Fix result;
    result.status = FixStatus::Fix;
    result.position_ecef = antenna_ecef() + geodesy::enu_from_ecef_rotation(kHome).transpose() * error_enu_m;
    result.position = geodesy::geodetic_from_ecef(result.position_ecef);
    result.covariance_enu = Eigen::Matrix3d::Identity();
    const double speed = plane.speed(t_s);
    const Vector3d arm = Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()) * mounting.antenna_m;
    result.velocity_enu_mps = speed * Vector3d(std::cos(yaw_rad), std::sin(yaw_rad), 0) +
                              plane.yaw_rate(t_s) * Vector3d::UnitZ().cross(arm);
    result.velocity_covariance_enu = 0.0025 * Eigen::Matrix3d::Identity();
    result.used = {
        {gnss::System::GPS, 1}, {gnss::System::GPS, 2}, {gnss::System::GPS, 3}, {gnss::System::GPS, 4}};
    result.residuals_m = {0, 0, 0, 0};
    return result;
  }
  [[nodiscard]] double error_m(const Fix& solution) const {
    return (solution.position_ecef - antenna_ecef()).norm();
  }

  SensorMounting mounting;
  Plane plane;
  double t_s = 0, yaw_rad = 0;
  Vector3d enu_m = Vector3d::Zero();

 private:
  double bias_, scale_, travelled_m_ = 0;
};

DeadReckoningOptions options() {
  DeadReckoningOptions result;
  result.enabled = true;
  return result;
}
Fix no_fix() {
  Fix fix;
  fix.status = FixStatus::TooFewSatellites;
  return fix;
}

/// The filter's result at a time of the drive, with right fixes at every epoch up to it.
Fix drive_until(double end_s, Drive& drive, DeadReckoning& filter) {
  Fix result;
  while (drive.t_s < end_s) {
    const SensorReadings readings = drive.next();
    result = filter.update(kBegin + drive.t_s, readings, drive.fix());
  }
  return result;
}

// At rest the fix is returned; in motion the phases follow; without fixes the position is propagated.
TEST(DeadReckoning, AlignsCalibratesAndCoasts) {
  Drive drive(2e-4, 0.01);
  DeadReckoning filter(options(), drive.mounting);
  std::vector<FusionPhase> phases;
  Fix result;
  while (drive.t_s < 90) {
    const SensorReadings readings = drive.next();
    result = filter.update(kBegin + drive.t_s, readings, drive.fix());
    ASSERT_TRUE(result.fusion);
    if (phases.empty() || phases.back() != result.fusion->phase) phases.push_back(result.fusion->phase);
    if (drive.t_s < 9) {
      EXPECT_EQ(result.kind(), FixKind::Single);
    }
    EXPECT_LT(drive.error_m(result), 0.3) << drive.t_s;
  }
  EXPECT_EQ(phases,
            (std::vector{FusionPhase::Initialising, FusionPhase::Calibrating, FusionPhase::Navigating}));
  EXPECT_EQ(result.kind(), FixKind::Combined);
  EXPECT_TRUE(result.fusion->wheels_calibrated);
  const double begin_sigma = std::sqrt(result.covariance_enu.trace());
  // 300 m without satellites.
  while (drive.t_s < 120) {
    const SensorReadings readings = drive.next();
    result = filter.update(kBegin + drive.t_s, readings, no_fix());
    EXPECT_EQ(result.kind(), FixKind::DeadReckoning);
    EXPECT_TRUE(result.used.empty());
  }
  EXPECT_LT(drive.error_m(result), 1);
  const double sigma = std::sqrt(result.covariance_enu.trace());
  EXPECT_GT(sigma, begin_sigma);
  EXPECT_LT(drive.error_m(result), 3 * sigma);
  const double east =
      std::remainder(geodesy::kPi / 2 - drive.yaw_rad - result.fusion->heading_rad, 2 * geodesy::kPi);
  EXPECT_LT(std::abs(east), geodesy::radians(0.3));
  // Returns to the satellites.
  const SensorReadings readings = drive.next();
  EXPECT_EQ(filter.update(kBegin + drive.t_s, readings, drive.fix()).kind(), FixKind::Combined);
}

// Without wheels and constraints it coasts as well, by its inertial sensor.
TEST(DeadReckoning, CoastsByTheInertialSensorAlone) {
  Drive drive(1e-4);
  drive.mounting.wheels.reset();
  DeadReckoningOptions free = options();
  free.non_holonomic = false;
  DeadReckoning filter(free, drive.mounting);
  Fix result;
  while (drive.t_s < 120) {
    const SensorReadings readings = drive.next();
    result = filter.update(kBegin + drive.t_s, readings, drive.t_s < 100 ? drive.fix() : no_fix());
  }
  EXPECT_EQ(result.kind(), FixKind::DeadReckoning);
  EXPECT_LT(drive.error_m(result), 3 * std::sqrt(result.covariance_enu.trace()));
  EXPECT_LT(drive.error_m(result), 5);
}

// Fixes that jump by 40 m for ten seconds are rejected; fixes that stay there are accepted in the end.
TEST(DeadReckoning, DoesNotFollowReflections) {
  Drive drive;
  DeadReckoning filter(options(), drive.mounting);
  Fix result;
  while (drive.t_s < 70) {
    const SensorReadings readings = drive.next();
    const bool wrong = drive.t_s > 55 && drive.t_s < 65;
    result =
        filter.update(kBegin + drive.t_s, readings, drive.fix(wrong ? Vector3d(40, 0, 0) : Vector3d::Zero()));
    EXPECT_LT(drive.error_m(result), 0.5) << drive.t_s;
  }
  while (drive.t_s < 190) {
    const SensorReadings readings = drive.next();
    result = filter.update(kBegin + drive.t_s, readings, drive.fix({40, 0, 0}));
  }
  EXPECT_NEAR(drive.error_m(result), 40, 8);
}

// A fix with a correlated error counts once: a hundred of them at rest do not reduce the deviation tenfold.
TEST(DeadReckoning, LastingErrorsAreNotAveragedAway) {
  Drive drive;
  DeadReckoning filter(options(), drive.mounting);
  Fix result = drive_until(40, drive, filter);
  EXPECT_GT(std::sqrt(result.covariance_enu(0, 0)), 0.5);
  EXPECT_LT(std::sqrt(result.covariance_enu(0, 0)), 1);
}

TEST(DeadReckoning, AGapOfReadingsBeginsAnew) {
  Drive drive;
  DeadReckoning filter(options(), drive.mounting);
  Fix result = drive_until(40, drive, filter);
  EXPECT_TRUE(result.fused());
  for (int k = 0; k < 10; ++k) {
    (void)drive.next();
    result = filter.update(kBegin + drive.t_s, {}, no_fix());
  }
  EXPECT_FALSE(result.fused());
  EXPECT_EQ(result.kind(), FixKind::None);
}

TEST(DeadReckoning, StatesNoPositionBeyondItsLimit) {
  Drive drive;
  DeadReckoningOptions strict = options();
  strict.max_sigma_m = 1e-3;
  DeadReckoning filter(strict, drive.mounting);
  Fix result = drive_until(40, drive, filter);
  EXPECT_EQ(result.status, FixStatus::WeakGeometry);
}

TEST(InitialAttitude, NeedsSpeedAndAStraightWay) {
  Drive drive;
  const InitialAttitude initial_attitude(drive.mounting);
  ImuReading mean;
  mean.specific_force_mps2 = {0, 0, 9.8};
  EXPECT_FALSE(initial_attitude.begin(drive.fix(), mean, options()));  // at rest
  while (drive.t_s < 20) (void)drive.next();
  EXPECT_TRUE(initial_attitude.begin(drive.fix(), mean, options()));
  mean.angular_rate_radps.z() = 0.3;
  EXPECT_FALSE(initial_attitude.begin(drive.fix(), mean, options()));
  mean.angular_rate_radps.z() = 0;
  Fix vague = drive.fix();
  vague.velocity_covariance_enu = 9 * Eigen::Matrix3d::Identity();
  EXPECT_FALSE(initial_attitude.begin(vague, mean, options()));
}

// Rest gives the vertical: nose up by 5 deg, left side up by 2.
TEST(InitialAttitude, LevelsAtRest) {
  Drive drive;
  while (drive.t_s < 20) (void)drive.next();
  InitialAttitude initial_attitude(drive.mounting);
  const Eigen::Matrix3d enu_from_body =
      (Eigen::AngleAxisd(0, Vector3d::UnitZ()) * Eigen::AngleAxisd(-geodesy::radians(5), Vector3d::UnitY()) *
       Eigen::AngleAxisd(geodesy::radians(2), Vector3d::UnitX()))
          .toRotationMatrix();
  ImuReading rest;
  rest.specific_force_mps2 = enu_from_body.transpose() * Vector3d(0, 0, 9.8);
  rest.angular_rate_radps = {1e-3, 2e-3, 3e-3};
  initial_attitude.set_stationary(rest);
  const auto started = initial_attitude.begin(drive.fix(), rest, options());
  ASSERT_TRUE(started);
  const Eigen::Matrix3d found = geodesy::enu_from_ecef_rotation(kHome) * started->state.rotation();
  EXPECT_LT((found - enu_from_body).norm(), 1e-4);
  EXPECT_EQ(started->sensors.gyroscope_bias, rest.angular_rate_radps);
}

TEST(StandstillDetector, ByWheelsAndBySilence) {
  SensorMounting mounting;
  mounting.imu_interval_s = 0.01;
  RandomStream random(1, "standstill");
  ImuReading reading;
  const auto record_samples = [&](StandstillDetector& standstill, double shake) {
    for (int k = 0; k < 150; ++k) {
      reading.time = reading.time + 0.01;
      reading.specific_force_mps2 = {shake * random.normal(), 0, 9.8};
      standstill.add(reading);
    }
  };
  StandstillDetector silent(mounting);
  EXPECT_FALSE(silent.is_stationary(0.0));
  record_samples(silent, 0.01);
  EXPECT_TRUE(silent.is_stationary(0.1));
  EXPECT_FALSE(silent.is_stationary(10.0)) << "a smooth road";
  EXPECT_FALSE(silent.is_stationary(std::nullopt));
  record_samples(silent, 0.5);
  EXPECT_FALSE(silent.is_stationary(0.1));

  mounting.wheels = WheelModel{};
  StandstillDetector wheeled(mounting);
  record_samples(wheeled, 0.01);
  EXPECT_FALSE(wheeled.is_stationary(0.0));
  for (int k = 0; k < 6; ++k) wheeled.add(WheelReading{kBegin + 0.1 * k, 0.1, 0});
  EXPECT_TRUE(wheeled.is_stationary(10.0));
  wheeled.add(WheelReading{kBegin + 0.7, 0.1, 0.2});
  EXPECT_FALSE(wheeled.is_stationary(0.0));
}

}  // namespace
}  // namespace canyon::positioning
