#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "canyon/base/random.hpp"
#include "canyon/inertial/imu.hpp"
#include "canyon/inertial/magnetometer_options.hpp"

namespace canyon::inertial {

/// A magnetometer: y = (I + M) (field + steel by the way) + hard iron + 1/f and white noise, rounded and cut
/// off. Steel by the way is a Gauss-Markov process of the way that the vehicle has gone, in ENU axes. The
/// same seed gives the same errors.
class Magnetometer {
 public:
  Magnetometer(const MagnetometerOptions& options, std::uint64_t seed);
  /// The next sample [T], in the sensor's axes.
  /// @param field_enu_t the Earth's @param enu_from_sensor its attitude
  /// @param way_m that the vehicle has gone since the last sample, at least 0
  [[nodiscard]] Eigen::Vector3d measure(const Eigen::Vector3d& field_enu_t,
                                        const Eigen::Matrix3d& enu_from_sensor, double way_m);

 private:
  MagnetometerOptions options_;
  RandomStream random_, steel_random_;
  Triad triad_;
  Eigen::Vector3d steel_enu_t_;
};

}  // namespace canyon::inertial
