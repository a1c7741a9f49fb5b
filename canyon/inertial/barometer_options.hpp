#pragma once

#include <Eigen/Core>

#include "canyon/options/fwd.hpp"

namespace canyon::inertial {

/// A pressure sensor and the air about it. The defaults are an MS5611-01BA03 (data sheet: resolution 1.2 Pa
/// RMS at 4,096 samples of oversampling; accuracy 150 Pa at 25 deg C) on a calm day of the standard
/// atmosphere.
struct BarometerOptions {
  double rate_hz = 25;                                   ///< samples, [0.1, 1000]
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< forward, left, up from the trajectory's point
  double sea_level_pressure_pa = 101325;                 ///< of the day, [85000, 110000]
  double sea_level_temperature_c = 15;                   ///< of the day, [-60, 50]
  double noise_pa = 1.2;                                 ///< standard deviation of a sample, [0, 1000]
  double turn_on_pa = 75;                                ///< standard deviation of the run's error, [0, 5000]
  double drift_pa = 5;        ///< standard deviation of the error that changes, [0, 5000]
  double drift_time_s = 600;  ///< time constant of that, [1, 100000]
  double airflow = 0;         ///< share of the dynamic pressure that is felt, [-2, 2]
  double resolution_pa = 0;   ///< step of the reading, [0, 1000]; 0: none

  void validate() const;
};

void visit(options::Visitor& v, BarometerOptions& o);

}  // namespace canyon::inertial
