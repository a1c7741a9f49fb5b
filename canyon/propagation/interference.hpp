#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "canyon/gnss/signals.hpp"

namespace canyon::propagation {

/// Distribution of an unwanted wave's power over frequencies.
struct Spectrum {
  enum class Shape : std::uint8_t {
    Band,   ///< flat over width_hz about centre_hz: wide-band noise, matched noise where as wide as a signal
    Tone,   ///< all on centre_hz
    Chirp,  ///< a saw-tooth sweep over width_hz about centre_hz, once in period_s
    Code,   ///< a ranging signal of another code: modulation and chip_rate_hz about centre_hz
  };
  Shape shape = Shape::Band;
  double centre_hz = gnss::kL1_hz;
  double width_hz = 0;
  double period_s = 0;
  gnss::Modulation modulation = gnss::Modulation::BPSK;
  double chip_rate_hz = 0;

  [[nodiscard]] bool operator==(const Spectrum&) const = default;
};

enum class Polarisation : std::uint8_t { Right, Left, Linear };

/// A wave at the antenna that no satellite sends: a jammer's or a spoofer's.
struct Interference {
  Spectrum spectrum;
  /// Power at an isotropic antenna of the wave's own polarisation [dBW].
  double power_dbw = -200;
  Polarisation polarisation = Polarisation::Linear;
  /// Unit, from the antenna towards where it comes from, in the frame of the arrival's paths.
  Eigen::Vector3d arrival = Eigen::Vector3d::UnitZ();
  /// Satellite whose signal it repeats: for that satellite's channels it is a path, not noise.
  std::optional<gnss::SatelliteId> copy_of{};
};

}  // namespace canyon::propagation
