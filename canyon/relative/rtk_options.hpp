#pragma once

#include <cstdint>

#include "canyon/options/fwd.hpp"

namespace canyon::relative {

/// Satellite clocks and ionosphere move apart by so much over the age of the base's epoch [m/s]: RTKLIB's
/// stats-clkstab, 5e-12 s/s.
inline constexpr double kAgeing_mps = 1.5e-3;

/// Use of whole numbers that were found.
enum class Integers : std::uint8_t {
  Continuous,     ///< they are searched for at each epoch; the filter goes on with real ones
  Instantaneous,  ///< likewise, and the filter forgets all phases from one epoch to the next
  Hold,           ///< numbers that were found hold the filter's real ones from then on ("fix and hold")
};

/// Real-time kinematic positioning relative to a base (docs/rtk.md).
struct RtkOptions {
  bool enabled = false;
  Integers integers = Integers::Continuous;
  /// The second best whole numbers must be so many times farther from the real ones than the best [1],
  /// [1.1, 10]. Default: RTKLIB's pos2-arthres.
  double ratio = 3;
  /// Probability that the search finds the right numbers, by the filter's covariance
  /// (bootstrapped_success()), [0, 1): numbers below it are refused.
  double min_success = 0.95;
  /// Where no fix of all satellites passes, those with the least certain phases are left out of the search.
  bool partial = true;
  /// Whole numbers of GLONASS also where the biases of phases against codes are not known at base and rover
  /// (SignalMeasurement::aligned); right where both are of one make, whose biases are the same.
  bool fix_glonass = false;
  /// Satellites below are in the filter and not in the search, [0, pi/2).
  double fix_elevation_rad = 0.26179938779914941;  // 15 deg
  /// Satellites that a fix needs, [4, 30].
  int min_satellites = 5;
  /// Deviation of a phase [m], (0, 0.1]: sigma^2 = a^2 (1 + 1 / sin(elevation)^2 + 10^((45 - C/N0) / 10)).
  /// Default: RTKLIB's stats-errphase and stats-errphaseel.
  double phase_sigma_m = 0.003;
  /// Deviation of a code over that of its phase [1], [1, 1000]: RTKLIB's stats-eratio1.
  double code_ratio = 100;
  /// Difference of the ionosphere's vertical delays at 1575.42 MHz over the distance of base and rover [1],
  /// [0, 1e-3]: from 1 km on the filter estimates a delay for each satellite, known to so much before. 0:
  /// none.
  double ionosphere_gradient = 2e-6;
  /// The ranges of rover and base without the troposphere of errors::saastamoinen_delay_m().
  bool troposphere = true;
  /// Likewise of the troposphere's zenith delay, from 5 km on: one delay [1], [0, 1e-3].
  double troposphere_gradient = 1e-6;
  /// Spectral densities of the white accelerations that the filter expects [m/s^2/sqrt(Hz)], (0, 100].
  double acceleration_horizontal = 3.16;
  double acceleration_vertical = 1;
  /// Innovations beyond so many of their standard deviations: a code is left out, a phase has slipped; > 1.
  double gate_sigmas = 4;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, RtkOptions& o);

}  // namespace canyon::relative
