#include "canyon/inertial/magnetometer.hpp"

#include <cmath>

namespace canyon::inertial {

Magnetometer::Magnetometer(const MagnetometerOptions& options, std::uint64_t seed)
    : options_(options),
      random_(seed, "magnetometer"),
      steel_random_(seed, "magnetometer/surroundings"),
      triad_(magnetometer_numbers(options), random_),
      steel_enu_t_(options.surroundings_ut * 1e-6 * three_normals(steel_random_)) {
  options.validate();
}

Eigen::Vector3d Magnetometer::measure(const Eigen::Vector3d& field_enu_t,
                                      const Eigen::Matrix3d& enu_from_sensor, double way_m) {
  if (options_.surroundings_ut > 0 && way_m > 0) {
    const double keep = std::exp(-way_m / options_.surroundings_m);
    steel_enu_t_ = keep * steel_enu_t_ + options_.surroundings_ut * 1e-6 * std::sqrt(1 - keep * keep) *
                                             three_normals(steel_random_);
  }
  const Eigen::Vector3d felt = enu_from_sensor.transpose() * (field_enu_t + steel_enu_t_);
  return triad_.measure(felt, Eigen::Vector3d::Zero(), 1 / options_.rate_hz, random_);
}

}  // namespace canyon::inertial
