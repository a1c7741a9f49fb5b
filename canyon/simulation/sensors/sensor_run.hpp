#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "canyon/inertial/sensor_options.hpp"
#include "canyon/simulation/sensors/barometer_run.hpp"
#include "canyon/simulation/sensors/inertial_run.hpp"
#include "canyon/simulation/sensors/wheel_run.hpp"

namespace canyon::simulation {

/// Samples of a vehicle's sensors that ended since the epoch before, in order.
struct SensorBatch {
  std::vector<InertialSample> imu;
  std::vector<WheelsAtWork> wheels;
  std::vector<BarometerSample> barometer;
};

/// The sensors of a vehicle, from epoch to epoch.
class SensorRun {
 public:
  /// @param vehicle its path, which must outlive this; smooth for sensors that feel its motion
  /// @param pose the vehicle's on that path, over the terrain
  /// @param geoid_undulation_m mean sea level above the ellipsoid
  SensorRun(const inertial::SensorOptions& options, std::uint64_t seed, geodesy::GpsTime begin,
            const Trajectory& vehicle, const std::function<Pose(geodesy::GpsTime)>& pose,
            double geoid_undulation_m) {
    if (options.imu) imu_.emplace(*options.imu, seed, begin, body_along(vehicle));
    if (options.wheels) wheels_.emplace(*options.wheels, seed, begin, pose);
    if (options.barometer) barometer_.emplace(*options.barometer, seed, begin, pose, geoid_undulation_m);
  }

  /// The samples since the last call. Valid until the next one.
  [[nodiscard]] const SensorBatch& until(geodesy::GpsTime time) {
    take(imu_, time, batch_.imu);
    take(wheels_, time, batch_.wheels);
    take(barometer_, time, batch_.barometer);
    return batch_;
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
  SensorBatch batch_;
};

}  // namespace canyon::simulation
