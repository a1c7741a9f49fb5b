#pragma once

#include <array>
#include <complex>
#include <vector>

#include "canyon/base/random.hpp"
#include "canyon/inertial/ideal_imu.hpp"
#include "canyon/inertial/imu_options.hpp"

namespace canyon::inertial {

/// Vibrations of an inertial sensor. Samples are their means over an interval, so that a frequency f above
/// half the rate of the samples stays in them, at the distance to the next multiple of the rate, with the
/// amplitude |sin(pi f dt) / (pi f dt)| of its own.
class Vibrations {
 public:
  Vibrations(const std::vector<VibrationOptions>& lines, RandomStream& random);
  /// The mean over the `dt_s` that end at `time_s`: specific force and rate in the sensor's axes.
  [[nodiscard]] ImuInput mean(double time_s, double dt_s, RandomStream& random);

 private:
  /// Amplitudes and phases of three axes [m/s^2], then of three [rad/s].
  using Phasors = std::array<std::complex<double>, 6>;
  struct Line {
    double frequency_hz, decay_per_s;  ///< of the correlation of its amplitude
    std::array<double, 2> amplitude;   ///< [m/s^2], [rad/s]
    Phasors phasors;
  };
  std::vector<Line> lines_;
};

}  // namespace canyon::inertial
