#pragma once

#include <Eigen/Core>
#include <array>

#include "canyon/base/random.hpp"
#include "canyon/geodesy/gps_time.hpp"

namespace canyon::errors {

/// A random function of time and place with mean 0 and variance 1 over its realizations: a sum of waves of
/// equal amplitude, whose frequencies and wave vectors are drawn from a normal spectral density and whose
/// phases are uniform (spectral representation: M. Shinozuka, G. Deodatis, Appl. Mech. Rev. 44(4), 1991). Its
/// autocorrelation is exp(-dt^2 / (2 time^2) - dx^2 / (2 length^2)). It is smooth, and has no memory: each
/// instant and place has its value, whoever asks and in whatever order.
class RandomWaves {
 public:
  /// @param time_s > 0; @param length_m > 0, infinite: the same everywhere
  RandomWaves(RandomStream stream, double time_s, double length_m);
  /// @param place any point of a frame that all who ask share [m]
  [[nodiscard]] double at(geodesy::GpsTime time, const Eigen::Vector3d& place) const;

 private:
  using Waves = std::array<double, 24>;
  Waves frequency_hz_, x_per_m_, y_per_m_, z_per_m_, phase_turns_;
};

}  // namespace canyon::errors
