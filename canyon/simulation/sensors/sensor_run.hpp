#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "canyon/inertial/sensor_options.hpp"
#include "canyon/simulation/sensors/inertial_run.hpp"
#include "canyon/simulation/sensors/wheel_run.hpp"

namespace canyon::simulation {

/// Samples of a vehicle's sensors that ended since the epoch before, in order.
struct SensorBatch {
  std::vector<InertialSample> imu;
  std::vector<WheelsAtWork> wheels;
};

/// The sensors of a vehicle, from epoch to epoch.
class SensorRun {
 public:
  /// @param vehicle its path, which is smooth and must outlive this
  SensorRun(const inertial::SensorOptions& options, std::uint64_t seed, geodesy::GpsTime begin,
            const Trajectory& vehicle) {
    if (options.imu) imu_.emplace(*options.imu, seed, begin, body_along(vehicle));
    if (options.wheels)
      wheels_.emplace(*options.wheels, seed, begin, [&vehicle](geodesy::GpsTime t) { return vehicle.at(t); });
  }

  /// The samples since the last call. Valid until the next one.
  [[nodiscard]] const SensorBatch& until(geodesy::GpsTime time) {
    batch_.imu.clear();
    batch_.wheels.clear();
    while (imu_) {
      auto sample = imu_->next(time);
      if (!sample) break;
      batch_.imu.push_back(*sample);
    }
    while (wheels_) {
      auto sample = wheels_->next(time);
      if (!sample) break;
      batch_.wheels.push_back(*sample);
    }
    return batch_;
  }

 private:
  std::optional<InertialRun> imu_;
  std::optional<WheelRun> wheels_;
  SensorBatch batch_;
};

}  // namespace canyon::simulation
