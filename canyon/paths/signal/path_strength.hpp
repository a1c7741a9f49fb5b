#pragma once

#include <complex>
#include <vector>

#include "canyon/base/options/fwd.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/paths/signal/antenna_pattern.hpp"
#include "canyon/paths/signal/radio_materials.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::signal {

/// From satellite to C/N0 in a clear sky: C/N0 = P + G - 10 log10(k T) - losses.
struct LinkBudgetOptions {
  /// Power of the signal over its specified minimum [dB], [-10, 20]. GPS L1 C/A may have 0 to 5.5 (at most
  /// -153 dBW, IS-GPS-200 6.3.1).
  double above_minimum_db = 3;
  /// T_a [K] of sky (5), ground and losses (290), [2, 1000]; 211 published for GPS L1 (docs/propagation.md).
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

/// Increase [dB] of the received power over that at 5 degrees: the satellite's shaped beam minus free-space
/// loss. 0 at 5, 2 at 40 and 0 at 90 degrees (IS-GPS-200 figure 6-1, minimum received power of L1 C/A),
/// parabolas between; within 1.3 dB of a link budget from published antenna gains and ranges. Used for all
/// systems.
/// @param elevation_rad [-pi/2, pi/2]; below the horizon as at 0 degrees
[[nodiscard]] double elevation_rise_db(double elevation_rad);

/// N0 [dBW/Hz] = 10 log10(k (T_a + T_0 (F - 1))), k of the SI, T_0 = 290 K.
[[nodiscard]] double noise_density_dbw_per_hz(const LinkBudgetOptions& options);

/// C/N0 [dB-Hz] of an unobstructed line of sight: the link budget of gnss::Signal::minimum_dbw, the reference
/// of path_amplitude(). InputError for an elevation of NaN. @param options valid
[[nodiscard]] double los_cn0_dbhz(const gnss::Signal& signal, double elevation_rad,
                                  const AntennaPattern& antenna, const LinkBudgetOptions& options = {});

/// Options of the strength model, for all paths.
struct StrengthOptions {
  /// True: facades are slabs in air, of their material's default thickness or Incidence::thickness_m. False:
  /// half spaces, like walls of infinite thickness. Ground and metal are always half spaces.
  bool slabs = true;
};
void visit(options::Visitor& v, StrengthOptions& o);

/// The wave at the antenna relative to the RHCP wave of a clear direct path, after reflections, edge and
/// foliage, with the phase of the detour, e^(-2 pi j excess / lambda) (time dependence exp(+j w t)). An
/// edge's own detour, lambda nu^2 / 4, is part of edge_wave() and not counted twice. Spreading is that of a
/// plane wave: a detour of 300 m is 0.1 mdB at 20,000 km. Not modelled: phases from the orientation of the
/// antenna (wind-up), and the satellite's own ellipticity (below 1.2 dB on L1, IS-GPS-200 3.3.1.8).
/// @param frequency_hz carrier, 1 to 10 GHz
/// InputError for options or values out of range.
[[nodiscard]] CircularWave arriving_wave(const propagation::PathGeometry& path, double frequency_hz,
                                         const StrengthOptions& options = {});

/// Output amplitude of an antenna over that of an ideal 0 dBic antenna in a clear RHCP wave. The sum of an
/// antenna's two hands depends on azimuth, which no pattern specifies. The magnitude is the mean over
/// azimuth, |a|^2 = G_R |R|^2 + G_L |L|^2, the phase that of sqrt(G_R) R + sqrt(G_L) L.
[[nodiscard]] std::complex<double> antenna_output(const CircularWave& wave, const AntennaGain& gain);

/// Amplitude [1] of a path at the antenna's output over that of the unobstructed line of sight to the same
/// satellite at `satellite_elevation_rad`; a factor of the correlator outputs. 1 for the direct path.
[[nodiscard]] std::complex<double> path_amplitude(const propagation::PathGeometry& path,
                                                  double satellite_elevation_rad, double frequency_hz,
                                                  const AntennaPattern& antenna,
                                                  const StrengthOptions& options = {});

/// The same for a path of Propagator::trace(). Diffracted: with the edge's nu at `frequency_hz`, from its
/// excess path, independent of the carrier of the edge search; only the sign of edge_nu counts. Diffuse:
/// sqrt(scattered_power) times the antenna's response to an unpolarised wave (half of its power in each hand)
/// over that to the line of sight, sqrt((G_R + G_L) / 2 / G_R(satellite)), with the phase of its excess. The
/// phase of the path itself is random (tracking::PathPhases), and `options` have no effect. Transmitted: a
/// right-hand wave's, with the phase of its carrier's excess. All: multiplied by Path::amplitude_factor.
/// InputError also for a negative scattered power or factor.
[[nodiscard]] std::complex<double> path_amplitude(const propagation::Path& path,
                                                  double satellite_elevation_rad, double frequency_hz,
                                                  const AntennaPattern& antenna,
                                                  const StrengthOptions& options = {});

/// path_amplitude() of each of the view's paths.
/// @param amplitudes replaced; it keeps its capacity
void path_amplitudes(const propagation::SatelliteView& view, double carrier_hz, const AntennaPattern& antenna,
                     const StrengthOptions& options, std::vector<std::complex<double>>& amplitudes);

}  // namespace canyon::signal
