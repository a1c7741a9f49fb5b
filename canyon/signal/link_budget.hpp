#pragma once

#include "canyon/gnss/signals.hpp"
#include "canyon/options/fwd.hpp"
#include "canyon/signal/antenna_pattern.hpp"

namespace canyon::signal {

/// From satellite to C/N0 in a clear sky: C/N0 = P + G - 10 log10(k T) - losses.
struct LinkBudgetOptions {
  /// The signal over its promised minimum [dB], [-10, 20]. GPS L1 C/A may have 0 to 5.5 (at most -153 dBW,
  /// IS-GPS-200 6.3.1).
  double above_minimum_db = 3;
  /// T_a [K] of sky (5), ground and losses (290), [2, 1000]; 211 in a published GPS L1 budget
  /// (docs/propagation.md).
  double antenna_temperature_k = 211;
  /// Noise figure of the receiver with its amplifier [dB], [0, 20]; 1 to 4 (u-blox ZED-F9 integration manual:
  /// antenna below 4).
  double noise_figure_db = 2;
  /// Loss by filter, quantisation and correlation [dB], [0, 20]; 0.5 to 2.
  double implementation_loss_db = 1;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, LinkBudgetOptions& o);

/// Rise [dB] of the received power over that at 5 degrees: the satellite's shaped beam less free space. 0 at
/// 5, 2 at 40 and 0 at 90 degrees (IS-GPS-200 figure 6-1, minimum received power of L1 C/A), parabolas
/// between; within 1.3 dB of a link budget from published antenna gains and ranges. Taken for every system.
/// @param elevation_rad [-pi/2, pi/2]; that of 0 degrees below the horizon
[[nodiscard]] double elevation_rise_db(double elevation_rad);

/// N0 [dBW/Hz] = 10 log10(k (T_a + T_0 (F - 1))), k of the SI, T_0 = 290 K.
[[nodiscard]] double noise_density_dbw_per_hz(const LinkBudgetOptions& options);

/// C/N0 [dB-Hz] of an unobstructed line of sight: gnss::Signal::minimum_dbw through the budget, the reference
/// of path_amplitude(). InputError for options out of range or an elevation of NaN.
[[nodiscard]] double los_cn0_dbhz(const gnss::Signal& signal, double elevation_rad,
                                  const AntennaPattern& antenna, const LinkBudgetOptions& options = {});

}  // namespace canyon::signal
