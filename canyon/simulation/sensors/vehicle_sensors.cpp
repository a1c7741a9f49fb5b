#include "canyon/simulation/sensors/vehicle_sensors.hpp"

#include <fmt/format.h>

#include "canyon/base/input_error.hpp"

namespace canyon::simulation {
namespace {

positioning::TriadModel model_of(const inertial::TriadNumbers& numbers) {
  return {numbers.white, numbers.flicker, numbers.walk, numbers.turn_on, numbers.scale, numbers.misalignment};
}

}  // namespace

void check_sensors(const inertial::SensorOptions& sensors, const ReceiverConfig& receiver) {
  if (!receiver.options.dead_reckoning.enabled) return;
  const std::string& name = receiver.options.name;
  if (!sensors.imu) {
    throw InputError(
        fmt::format("receiver '{}' has dead reckoning, and the vehicle has no inertial sensor", name),
        "add sensors: {imu: {profile: automotive}, wheels: {}}, or set dead_reckoning: {enabled: "
        "false}");
  }
  if (receiver.fixed) {
    throw InputError(fmt::format("receiver '{}' has dead reckoning, and a fixed place", name),
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
    const Eigen::Matrix3d turn = body_from_sensor(sensors.imu->orientation, sensors.imu->axes);
    for (const InertialSample& sample : batch.imu) {
      if (!sample.sample) continue;
      const inertial::ImuInput& measured = sample.sample->measured;
      readings.imu.push_back({begin + sample.sample->time_s, turn * measured.specific_force_mps2,
                              turn * measured.angular_rate_radps});
    }
  }
  for (const WheelsAtWork& sample : batch.wheels) {
    const inertial::WheelPair& speeds = sample.sample.speed_mps;
    readings.wheels.push_back({sample.time, sample.dt_s, (speeds[0] + speeds[1]) / 2});
  }
  return readings;
}

}  // namespace canyon::simulation
