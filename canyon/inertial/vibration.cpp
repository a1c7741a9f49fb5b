#include "canyon/inertial/vibration.hpp"

#include <cmath>

#include "canyon/geodesy/constants.hpp"

namespace canyon::inertial {
namespace {

using geodesy::kPi;

/// A complex number whose square has the mean 1, with normal parts.
std::complex<double> complex_normal(RandomStream& random) {
  const double real = random.normal();
  return std::sqrt(0.5) * std::complex<double>(real, random.normal());
}

}  // namespace

Vibrations::Vibrations(const std::vector<VibrationOptions>& lines, RandomStream& random) {
  for (const VibrationOptions& options : lines) {
    // The spectrum of a correlation exp(-d t) has half its height d / (2 pi) from its middle.
    Line& line = lines_.emplace_back(Line{options.frequency_hz,
                                          kPi * options.bandwidth_hz,
                                          {options.acceleration_mps2, geodesy::radians(options.rate_deg_s)},
                                          {}});
    for (std::complex<double>& phasor : line.phasors) {
      phasor = line.decay_per_s > 0 ? complex_normal(random) : std::polar(1.0, 2 * kPi * random.uniform());
    }
  }
}

ImuInput Vibrations::mean(double time_s, double dt_s, RandomStream& random) {
  ImuInput sum;
  for (Line& line : lines_) {
    const double half_turn = kPi * line.frequency_hz * dt_s;
    const std::complex<double> middle =
        std::polar(std::sin(half_turn) / half_turn, 2 * kPi * line.frequency_hz * (time_s - dt_s / 2));
    const double keep = std::exp(-line.decay_per_s * dt_s), drive = std::sqrt(1 - keep * keep);
    for (std::size_t i = 0; i < line.phasors.size(); ++i) {
      std::complex<double>& phasor = line.phasors[i];
      if (line.decay_per_s > 0) phasor = keep * phasor + drive * complex_normal(random);
      Eigen::Vector3d& kind = i < 3 ? sum.specific_force_mps2 : sum.angular_rate_radps;
      kind[static_cast<Eigen::Index>(i % 3)] += line.amplitude.at(i / 3) * (phasor * middle).real();
    }
  }
  return sum;
}

}  // namespace canyon::inertial
