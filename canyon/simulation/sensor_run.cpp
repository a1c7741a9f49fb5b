#include "canyon/simulation/sensor_run.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/magnetic_field.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/simulation/motion/antenna_pose.hpp"
#include "canyon/simulation/motion/smooth_motion.hpp"

namespace canyon::simulation {

using Eigen::Vector3d;
using geodesy::GpsTime;

SensorMotion::SensorMotion(const inertial::BodyState& sensor, inertial::ImuAxes axes) {
  const geodesy::Geodetic position = geodesy::geodetic_from_ecef(sensor.position_m);
  const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(position);
  position_deg_m = {geodesy::degrees(position.latitude_rad), geodesy::degrees(position.longitude_rad),
                    position.height_m};
  velocity_enu_mps = enu_from_ecef * sensor.velocity_mps;
  const Eigen::Matrix3d enu_from_sensor = enu_from_ecef * sensor.ecef_from_body;
  const Vector3d forward = enu_from_sensor.col(0);
  const double side = axes == inertial::ImuAxes::Frd ? -1 : 1;  // to the left and up
  const double heading_deg = geodesy::degrees(std::atan2(forward.x(), forward.y()));
  attitude_deg = {geodesy::degrees(std::atan2(side * enu_from_sensor(2, 1), side * enu_from_sensor(2, 2))),
                  geodesy::degrees(std::asin(std::clamp(forward.z(), -1.0, 1.0))),
                  heading_deg < 0 ? heading_deg + 360 : heading_deg};
}

namespace {

/// Steps of a sample's mean: even in number, each at most 2.5 ms.
std::int64_t steps_of(double rate_hz) {
  constexpr double kStep_s = 0.0025;
  return 2 * static_cast<std::int64_t>(std::ceil(1 / rate_hz / (2 * kStep_s) - 1e-9));
}

}  // namespace

InertialRun::InertialRun(const inertial::ImuOptions& options, std::uint64_t seed, GpsTime begin,
                         const std::function<inertial::BodyState(GpsTime)>& vehicle)
    : SampleTimes(begin, options.rate_hz),
      steps_(steps_of(options.rate_hz)),
      ideal_(
          options, [begin, vehicle](double t_s) { return vehicle(begin + t_s); },
          1 / options.rate_hz / static_cast<double>(steps_)),
      imu_(options, seed) {}

std::optional<InertialSample> InertialRun::next(GpsTime until) {
  const auto interval = pass(until);
  if (!interval) return std::nullopt;
  const std::int64_t end = count() * steps_;
  InertialSample sample;
  sample.time = begin() + interval->to_s;
  sample.mean = ideal_.mean(end - steps_, end);
  sample.truth = ideal_.at(end);
  sample.sample = imu_.measure(sample.mean, interval->to_s, interval->to_s - interval->from_s);
  if (sample.sample) sample.reported = begin() + sample.sample->time_s;
  return sample;
}

using inertial::WheelPair;

WheelPair WheelRun::speeds(geodesy::GpsTime t) const {
  const Pose pose = vehicle_(t);
  const double middle = pose.forward_enu().dot(pose.velocity_enu_mps);
  const double rotation = pose.yaw_rate_radps * options_.track_m / 2;
  return {middle - rotation, middle + rotation};
}

void WheelRun::skip(geodesy::GpsTime time) {
  if (SampleTimes::skip(time)) last_ = speeds(begin() + end_s());
}

std::optional<WheelsAtWork> WheelRun::next(geodesy::GpsTime until) {
  const auto interval = pass(until);
  if (!interval) return std::nullopt;
  WheelsAtWork result;
  result.time = begin() + interval->to_s;
  result.dt_s = interval->to_s - interval->from_s;
  // The distance by Simpson's rule, in an even number of steps of at most 25 ms.
  constexpr double kStep_s = 0.025;
  const int steps = 2 * std::max(1, static_cast<int>(std::ceil(result.dt_s / (2 * kStep_s) - 1e-9)));
  WheelPair sum = last_;
  for (int i = 1; i <= steps; ++i) {
    last_ = speeds(begin() + (interval->from_s + result.dt_s * i / steps));
    const double weight = i == steps ? 1 : i % 2 == 1 ? 4 : 2;
    for (std::size_t w = 0; w < sum.size(); ++w) sum[w] += weight * last_[w];
  }
  WheelPair travelled_m{};
  for (std::size_t w = 0; w < sum.size(); ++w) {
    result.true_mps[w] = sum[w] / (3 * steps);
    travelled_m[w] = result.true_mps[w] * result.dt_s;
    for (const inertial::SensorFault& slip : options_.slips)
      if (slip.holds(interval->to_s)) travelled_m[w] *= slip.factor;
  }
  result.sample = sensor_.measure(travelled_m, result.dt_s);
  return result;
}

WheelTwist wheel_twist(const WheelsAtWork& wheels, const inertial::WheelOptions& options) {
  constexpr double kSideways_mps = 0.05, kUpwards_mps = 0.1;
  const auto [left, right] = wheels.sample.speed_mps;
  const auto variance = [&](double speed) {
    const double tick_mps = options.tick_m / wheels.dt_s;
    return (options.scale * options.scale + options.slip * options.slip) * speed * speed +
           tick_mps * tick_mps / 6;
  };
  const double track_m = options.track_m, sum = variance(left) + variance(right);
  WheelTwist twist;
  twist.forward_mps = (left + right) / 2;
  twist.yaw_rate_radps = track_m > 0 ? (right - left) / track_m : 0;
  const std::array<double, 6> diagonal{sum / 4,
                                       kSideways_mps * kSideways_mps,
                                       kUpwards_mps * kUpwards_mps,
                                       kUnknownVariance,
                                       kUnknownVariance,
                                       track_m > 0 ? sum / (track_m * track_m) : kUnknownVariance};
  for (std::size_t i = 0; i < diagonal.size(); ++i) twist.covariance.at(7 * i) = diagonal.at(i);
  if (track_m > 0)
    twist.covariance[5] = twist.covariance[30] = (variance(right) - variance(left)) / (2 * track_m);
  return twist;
}

std::optional<BarometerSample> BarometerRun::next(geodesy::GpsTime until) {
  const auto interval = pass(until);
  if (!interval) return std::nullopt;
  const double now_s = interval->to_s;
  BarometerSample sample;
  sample.time = begin() + now_s;
  const Pose pose = mounted_antenna(vehicle_(sample.time), options_.position_m);
  sample.height_m = pose.position.height_m - geoid_undulation_m_;
  sample.pressure = sensor_.measure(sample.height_m, pose.velocity_enu_mps.norm(), now_s);
  return sample;
}

std::optional<MagnetometerSample> MagnetometerRun::next(geodesy::GpsTime until) {
  const auto interval = pass(until);
  if (!interval) return std::nullopt;
  MagnetometerSample sample;
  sample.time = begin() + interval->to_s;
  const Pose pose = vehicle_(sample.time);
  const Eigen::Vector3d field_enu_t =
      geodesy::enu_from_ecef_rotation(pose.position) *
      geodesy::magnetic_field_tesla(geodesy::ecef_from_geodetic(pose.position), pose.time);
  const Eigen::Vector3d forward = pose.forward_enu(), up = pose.up_enu();
  Eigen::Matrix3d enu_from_sensor;
  enu_from_sensor << forward, up.cross(forward), up;
  enu_from_sensor *= body_from_sensor(options_.orientation, options_.axes);
  sample.measured_t =
      sensor_.measure(field_enu_t, enu_from_sensor, pose.velocity_enu_mps.norm() / options_.rate_hz);
  sample.true_t = enu_from_sensor.transpose() * field_enu_t;
  return sample;
}

namespace {

positioning::TriadModel model_of(const inertial::TriadNumbers& numbers) {
  return {numbers.white, numbers.flicker, numbers.walk, numbers.turn_on, numbers.scale, numbers.misalignment};
}

}  // namespace

inertial::SensorOptions sensors_of(const Scenario& scenario, std::size_t receiver) {
  return scenario.receivers.at(receiver).fixed ? inertial::SensorOptions() : scenario.sensors;
}

void check_sensors(const inertial::SensorOptions& sensors, const ReceiverConfig& receiver) {
  if (!receiver.options.dead_reckoning.enabled) return;
  const std::string& name = receiver.options.name;
  if (!sensors.imu) {
    throw InputError(
        fmt::format("receiver '{}' uses dead reckoning, but the vehicle has no inertial sensor", name),
        "add sensors: {imu: {profile: automotive}, wheels: {}}, or set dead_reckoning: {enabled: "
        "false}");
  }
  if (receiver.fixed) {
    throw InputError(fmt::format("receiver '{}' uses dead reckoning, but has a fixed position", name),
                     "leave fixed out, or set dead_reckoning: {enabled: false}");
  }
}

std::optional<receiver::VehicleSensors> vehicle_sensors(const inertial::SensorOptions& sensors,
                                                        const ReceiverConfig& receiver) {
  if (!receiver.options.dead_reckoning.enabled) return std::nullopt;
  check_sensors(sensors, receiver);
  const inertial::ImuOptions& imu = *sensors.imu;
  const inertial::ImuNumbers numbers = imu_numbers(imu);
  receiver::VehicleSensors result;
  positioning::SensorMounting& mounting = result.mounting;
  mounting.imu_interval_s = 1 / imu.rate_hz;
  mounting.antenna_m = receiver.lever_arm_m - imu.position_m;
  mounting.axle_m = -imu.position_m;
  mounting.gyroscope = model_of(numbers.gyroscope);
  mounting.accelerometer = model_of(numbers.accelerometer);
  if (sensors.wheels) {
    const inertial::WheelOptions& wheels = *sensors.wheels;
    // The mean of two wheels.
    constexpr double kMean = 0.70710678118654752;
    mounting.wheels = {wheels.rate_hz,
                       kMean * wheels.scale,
                       kMean * wheels.slip,
                       wheels.slip_time_s,
                       wheels.tick_m * wheels.rate_hz / 2,
                       wheels.direction};
  }
  return result;
}

positioning::SensorReadings readings_of(const SensorBatch& batch, const inertial::SensorOptions& sensors,
                                        geodesy::GpsTime begin) {
  positioning::SensorReadings readings;
  if (sensors.imu) {
    const Eigen::Matrix3d rotation = body_from_sensor(sensors.imu->orientation, sensors.imu->axes);
    for (const InertialSample& sample : batch.imu) {
      if (!sample.sample) continue;
      const inertial::ImuInput& measured = sample.sample->measured;
      readings.imu.push_back({begin + sample.sample->time_s, rotation * measured.specific_force_mps2,
                              rotation * measured.angular_rate_radps});
    }
  }
  for (const WheelsAtWork& sample : batch.wheels) {
    const inertial::WheelPair& speeds = sample.sample.speed_mps;
    readings.wheels.push_back({sample.time, sample.dt_s, (speeds[0] + speeds[1]) / 2});
  }
  return readings;
}

}  // namespace canyon::simulation
