#pragma once

#include <string>
#include <vector>

#include "canyon/inertial/sensor_options.hpp"
#include "canyon/simulation/sensors/sensor_run.hpp"

namespace canyon::output {

/// Numbers of a sensor, a row of `columns` for each sample.
struct SensorArray {
  std::string sensor;  ///< "imu"
  std::string name;    ///< "specific_force"
  std::size_t columns = 1;
  std::vector<double> values = {};  ///< row by row
};

/// Samples of a vehicle's sensors as arrays; docs/imu.md has their names, units and columns. Times are
/// seconds since the run's begin; values of lost samples are NaN.
class SensorArrays {
 public:
  SensorArrays(const inertial::SensorOptions& sensors, geodesy::GpsTime begin);
  void add(const simulation::SensorBatch& batch);
  /// Those of the sensors that there are.
  [[nodiscard]] std::vector<SensorArray>& arrays() { return arrays_; }

 private:
  inertial::SensorOptions sensors_;
  geodesy::GpsTime begin_;
  std::vector<SensorArray> arrays_;
};

}  // namespace canyon::output
