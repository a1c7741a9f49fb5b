#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "canyon/options/fwd.hpp"

namespace canyon::inertial {

/// Parts, which give the numbers that are not stated; docs/imu.md has their sources.
enum class BarometerProfile : std::uint8_t { Ideal, Ms5611, Bmp388 };

/// A pressure sensor and the air about it, by default a calm day of the standard atmosphere. Empty numbers:
/// by the profile.
struct BarometerOptions {
  BarometerProfile profile = BarometerProfile::Ms5611;
  double rate_hz = 25;                                   ///< samples, [0.1, 1000]
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< forward, left, up from the trajectory's point
  double sea_level_pressure_pa = 101325;                 ///< of the day, [85000, 110000]
  double sea_level_temperature_c = 15;                   ///< of the day, [-60, 50]
  double pressure_change_pa_h = 0;                       ///< of the day's pressure, [-2000, 2000]
  std::optional<double> noise_pa;                        ///< standard deviation of a sample, [0, 1000]
  std::optional<double> turn_on_pa;                      ///< standard deviation of the run's error, [0, 5000]
  std::optional<double> drift_pa;          ///< standard deviation of the error that changes, [0, 5000]
  double drift_time_s = 600;               ///< time constant of that, [1, 100000]
  std::optional<double> temperature_pa_k;  ///< standard deviation of the error by temperature, [0, 100]
  double warming_k = 10;                   ///< of the sensor over the air in the end, [-100, 100]
  double warming_time_s = 300;             ///< time constant of that, [1, 100000]
  double delay_s = 0;                      ///< age of the air that a sample states, [0, 10]
  double airflow = 0;                      ///< share of the dynamic pressure that is felt, [-2, 2]
  std::optional<double> resolution_pa;     ///< step of the reading, [0, 1000]; 0: none

  void validate() const;
};

/// Errors of a pressure sensor, as the options have them.
struct BarometerNumbers {
  double noise_pa = 0, turn_on_pa = 0, drift_pa = 0, temperature_pa_k = 0, resolution_pa = 0;
};
/// The numbers of the options, those of the profile where they are empty.
[[nodiscard]] BarometerNumbers barometer_numbers(const BarometerOptions& options);

void visit(options::Visitor& v, BarometerOptions& o);

}  // namespace canyon::inertial
