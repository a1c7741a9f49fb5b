#include "canyon/errors/random_waves.hpp"

#include <cmath>

#include "canyon/geodesy/constants.hpp"

namespace canyon::errors {

RandomWaves::RandomWaves(RandomStream stream, double time_s, double length_m) {
  for (Wave& wave : waves_) {
    wave.frequency_radps = stream.normal() / time_s;
    for (int axis = 0; axis < 3; ++axis) wave.vector_radpm[axis] = stream.normal() / length_m;
    wave.phase_rad = 2 * geodesy::kPi * stream.uniform();
  }
}

double RandomWaves::at(geodesy::GpsTime time, const Eigen::Vector3d& place) const {
  const double seconds = time - geodesy::GpsTime();
  double sum = 0;
  for (const Wave& wave : waves_) {
    sum += std::cos(wave.frequency_radps * seconds + wave.vector_radpm.dot(place) + wave.phase_rad);
  }
  return sum * std::sqrt(2.0 / static_cast<double>(waves_.size()));
}

}  // namespace canyon::errors
