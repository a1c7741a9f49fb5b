#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "canyon/inertial/sensor_options.hpp"
#include "canyon/simulation/sensors/barometer_run.hpp"
#include "canyon/simulation/sensors/inertial_run.hpp"
#include "canyon/simulation/sensors/magnetometer_run.hpp"
#include "canyon/simulation/sensors/wheel_run.hpp"

namespace canyon::simulation {

/// Samples of a vehicle's sensors that ended since the epoch before, in order. EpochSinks that use sensors
/// get them with each epoch, of runs and of live sessions.
struct SensorBatch {
  inertial::ImuAxes imu_axes = inertial::ImuAxes::Flu, magnetometer_axes = inertial::ImuAxes::Flu;
  std::vector<InertialSample> imu;
  std::vector<WheelsAtWork> wheels;
  std::vector<BarometerSample> barometer;
  std::vector<MagnetometerSample> magnetometer;
};

/// The sensors of a vehicle, from epoch to epoch.
class SensorRun {
 public:
  /// @param body the vehicle's smooth motion, for sensors that feel it (InertialRun)
  /// @param pose the vehicle's on the same path, over the terrain
  /// @param geoid_undulation_m mean sea level above the ellipsoid
  SensorRun(const inertial::SensorOptions& options, std::uint64_t seed, geodesy::GpsTime begin,
            const std::function<inertial::BodyState(geodesy::GpsTime)>& body,
            const std::function<Pose(geodesy::GpsTime)>& pose, double geoid_undulation_m) {
    if (options.imu) {
      imu_.emplace(*options.imu, seed, begin, body);
      batch_.imu_axes = options.imu->axes;
    }
    if (options.wheels) wheels_.emplace(*options.wheels, seed, begin, pose);
    if (options.barometer) barometer_.emplace(*options.barometer, seed, begin, pose, geoid_undulation_m);
    if (options.magnetometer) {
      magnetometer_.emplace(*options.magnetometer, seed, begin, pose);
      batch_.magnetometer_axes = options.magnetometer->axes;
    }
  }

  /// The samples since the last call. Valid until the next one.
  [[nodiscard]] const SensorBatch& until(geodesy::GpsTime time) {
    take(imu_, time, batch_.imu);
    take(wheels_, time, batch_.wheels);
    take(barometer_, time, batch_.barometer);
    take(magnetometer_, time, batch_.magnetometer);
    return batch_;
  }

  /// Leaves out the samples until `time`, for which there is no motion.
  void skip(geodesy::GpsTime time) {
    if (imu_) imu_->skip(time);
    if (wheels_) wheels_->skip(time);
    if (barometer_) barometer_->skip(time);
    if (magnetometer_) magnetometer_->skip(time);
  }

 private:
  template <typename Run, typename Sample>
  static void take(std::optional<Run>& run, geodesy::GpsTime until, std::vector<Sample>& samples) {
    samples.clear();
    while (run) {
      auto sample = run->next(until);
      if (!sample) break;
      samples.push_back(*sample);
    }
  }

  std::optional<InertialRun> imu_;
  std::optional<WheelRun> wheels_;
  std::optional<BarometerRun> barometer_;
  std::optional<MagnetometerRun> magnetometer_;
  SensorBatch batch_;
};

}  // namespace canyon::simulation
