#pragma once

#include "canyon/propagation/arrival.hpp"
#include "canyon/signal/antenna_pattern.hpp"
#include "canyon/tracking/correlation.hpp"

namespace canyon::tracking {

/// Spectral separation coefficient [1/Hz] of an interference with a signal: the integral over the front end's
/// band of both power spectral densities, each of unit power over all frequencies (J. W. Betz, Navigation
/// 48(4), 2001; Kaplan & Hegarty, 2nd ed. 2006, 6.3: 1 / (Q Rc)). Codes have the smooth spectra of their
/// chips.
///   Tone: the signal's density there. Band: its mean over the band.
///   Chirp: over the lines of a saw-tooth sweep, 1 / period apart, each of the power that the Fresnel
///   integrals give (J. R. Klauder et al., Bell System Technical Journal 39(4), 1960, by whose two edges the
///   ripples are); over 20,000 lines as Band.
///   Code: by Simpson's rule within 64 chip rates.
/// Relative error below 1e-3 (tests). @param carrier_hz of the signal
[[nodiscard]] double spectral_separation_per_hz(const Correlation& signal, double carrier_hz,
                                                const propagation::Spectrum& interference);

/// Power of a tone behind a correlator over that with a smooth spectrum: a code that repeats has lines, and
/// over an integration T the tone hits them or falls between. For random codes of `line_hz` between lines, N
/// = T line_hz repetitions: sin^2(pi d T) / (N sin^2(pi d / line_hz)), d from tone to carrier; mean 1, most
/// N.
[[nodiscard]] double line_factor(double offset_hz, double line_hz, double integration_s);

/// Share of its power [0, 1] within a band.
[[nodiscard]] double share_within(const propagation::Spectrum& interference, double centre_hz,
                                  double bandwidth_hz);

/// Amplitude gain (0, 1] that a stage of the third order leaves to weak signals beside a strong one: y = a1 x
/// + a3 x^3 has a1 + 3/2 a3 A^2 left beside the amplitude A, and compresses a single one by 1 dB where A^2 =
/// 0.145 |a1 / a3| (B. Razavi, RF Microelectronics, 2nd ed. 2012, 2.2.1: desensitisation), so that 1 - 0.2175
/// P / P1dB is left. From 4.6 P1dB on signals are blocked: 1e-3 is left.
/// @param over_compression power of the strong one over that of 1 dB of compression, >= 0
[[nodiscard]] double small_signal_gain(double over_compression);

/// Gain of an antenna for a wave [1, power] over an isotropic one of the wave's own polarisation; half of a
/// linear one's power is in each hand. @param band that the antenna receives
[[nodiscard]] double gain_for(const signal::AntennaPattern& antenna, const propagation::Interference& wave,
                              signal::Band band);

}  // namespace canyon::tracking
