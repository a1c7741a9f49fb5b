#include "canyon/errors/random_waves.hpp"

#include <cmath>
#include <cstddef>

#include "canyon/base/simd_clones.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::errors {
namespace {

/// cos(2 pi turns[k]) in place of turns[k], within 1e-13 for |turns[k]| < 1e9 beside the rounding of the
/// turns.
CANYON_CLONES void take_cosines(double* __restrict turns, std::size_t count) {
  constexpr double kWhole = 6755399441055744;  // 1.5 * 2^52: adding it rounds to a whole number
  for (std::size_t k = 0; k < count; ++k) {
    const double part = turns[k] - ((turns[k] + kWhole) - kWhole);
    // cos(2 pi part) = sin(2 pi (1/4 - |part|)), by its series.
    const double a = 2 * geodesy::kPi * (0.25 - (part < 0 ? -part : part)), y = a * a;
    double series = 1 - y / (18 * 19);
    series = 1 - y / (16 * 17) * series;
    series = 1 - y / (14 * 15) * series;
    series = 1 - y / (12 * 13) * series;
    series = 1 - y / (10 * 11) * series;
    series = 1 - y / (8 * 9) * series;
    series = 1 - y / (6 * 7) * series;
    series = 1 - y / (4 * 5) * series;
    series = 1 - y / (2 * 3) * series;
    turns[k] = a * series;
  }
}

}  // namespace

RandomWaves::RandomWaves(RandomStream stream, double time_s, double length_m) {
  constexpr double kTurn = 2 * geodesy::kPi;
  for (std::size_t k = 0; k < frequency_hz_.size(); ++k) {
    frequency_hz_[k] = stream.normal() / time_s / kTurn;
    x_per_m_[k] = stream.normal() / length_m / kTurn;
    y_per_m_[k] = stream.normal() / length_m / kTurn;
    z_per_m_[k] = stream.normal() / length_m / kTurn;
    phase_turns_[k] = stream.uniform();
  }
}

double RandomWaves::at(geodesy::GpsTime time, const Eigen::Vector3d& place) const {
  const double seconds = time - geodesy::GpsTime();
  Waves cosines;
  for (std::size_t k = 0; k < cosines.size(); ++k) {
    cosines[k] = frequency_hz_[k] * seconds +
                 (x_per_m_[k] * place.x() + y_per_m_[k] * place.y() + z_per_m_[k] * place.z()) +
                 phase_turns_[k];
  }
  take_cosines(cosines.data(), cosines.size());
  std::array<double, 4> sums{};
  for (std::size_t k = 0; k < cosines.size(); ++k) sums[k % sums.size()] += cosines[k];
  return ((sums[0] + sums[1]) + (sums[2] + sums[3])) * std::sqrt(2.0 / static_cast<double>(cosines.size()));
}

}  // namespace canyon::errors
