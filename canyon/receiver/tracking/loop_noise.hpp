#pragma once

#include "canyon/base/options/fwd.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/paths/signal/antenna_pattern.hpp"
#include "canyon/receiver/tracking/code_tracking.hpp"
#include "canyon/receiver/tracking/correlation.hpp"
#include "canyon/receiver/tracking/noise.hpp"

namespace canyon::tracking {

/// C/N0 as a ratio [Hz] from dB-Hz. Throws InputError for a value that is not finite.
[[nodiscard]] double cn0_hz(double cn0_dbhz);

/// Thermal noise of a code loop, and its bandwidth at low C/N0.
///
/// A fixed loop has
///
/// sigma^2 = Bn (1 - Bn T / 2) N,   N = V / S^2 * L / (C/N0): the variance V of the correlators' weighted
/// sum, sum over i, k of w_i w_k R(o_i - o_k), over the square of its slope S through the peak. For early
/// minus late it is the general expression of Kaplan & Hegarty (2nd ed. 2006, equation 5.22; Betz &
/// Kolodziejski, IEEE Trans. AES 45(4), 2009), whose integrals over the power spectral density are values and
/// slopes of R in the front end's bandwidth; 1 - Bn T / 2 is of the latter and near 1. For infinite bandwidth
/// and BPSK it is Bn D / (2 C/N0), twice that for DoubleDelta. Squaring loss L:
///   Coherent        1
///   EarlyLatePower  1 + (R(0) + R(D)) / (2 T C/N0 R(D/2)^2)   [BPSK: 1 + 2 / ((2 - D) T C/N0)]
///   DotProduct, DoubleDelta  1 + 1 / (T C/N0 R(0))
/// Valid for small errors (3 sigma below half the spacing, equation 5.21); C/N0 is that before the front
/// end's filter. Exact evaluation of these formulas to 1e-3 (the table of R).
///
/// Below DllOptions::narrow_below_dbhz the loop has the gain of a steady-state filter. For a delay with a
/// random walk q [chips^2/s], observed with white noise of density N, the gain is k = sqrt(q / N) and the
/// noise k N / 2 (Kalman & Bucy, J. Basic Eng. 83(1), 1961, for one state). So with k = 4 Bn
///   Bn(N) = Bn min(1, sqrt(N0 / N)),   N0 = N at narrow_below_dbhz,
/// and sigma grows with the fourth root of N there.
class CodeLoopNoise {
 public:
  explicit CodeLoopNoise(const CodeTracker& tracker);

  /// Used fraction (0, 1] of DllOptions::loop_bandwidth_hz. @param cn0 C/N0 as a ratio [Hz], above 0
  [[nodiscard]] double bandwidth_ratio(double cn0) const;
  /// Standard deviation of the code's error from thermal noise [m], one sigma. @param cn0 likewise
  [[nodiscard]] double sigma_m(double cn0) const;

 private:
  [[nodiscard]] double density(double cn0) const { return (first_ + second_ / cn0) / cn0; }

  double bandwidth_hz_, integration_s_;
  double first_ = 0, second_ = 0;  // N = first / (C/N0) + second / (C/N0)^2 [m^2/Hz]
  double narrow_from_ = 0;         // N0; infinite: never
};

/// A loop that tracks the carrier's phase, or its frequency.
template <bool kPhase>
struct CarrierLoopOptions {
  double loop_bandwidth_hz = kPhase ? 15 : 5;  ///< one-sided noise bandwidth Bn [Hz], (0, 100]
  double integration_s = 0.02;                 ///< T [s], (0, 10]; Bn T below 0.5
  gnss::SignalValues loop_bandwidths_hz{};     ///< of signals with another bandwidth [Hz]
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
template <bool kPhase>
void visit(options::Visitor& v, CarrierLoopOptions<kPhase>& o);
using PllOptions = CarrierLoopOptions<true>;
using FllOptions = CarrierLoopOptions<false>;
/// Standard deviation of an arctangent (Costas) phase lock loop's error from thermal noise [rad]:
/// sqrt(Bn / (C/N0) (1 + 1 / (2 T C/N0))) (Kaplan & Hegarty, 2nd ed. 2006, section 5.6.1.1). Times
/// wavelength / 2 pi it is metres. Valid below 15 degrees, where such loops lose lock (ibid.).
/// @param options valid
[[nodiscard]] double pll_jitter_rad(const PllOptions& options, double cn0_dbhz);

/// Standard deviation of a frequency lock loop's error from thermal noise [Hz]:
/// sqrt(4 F Bn / (C/N0) (1 + 1 / (T C/N0))) / (2 pi T) (Kaplan & Hegarty, 2nd ed. 2006, section 5.6.2).
/// @param options valid
[[nodiscard]] double fll_jitter_hz(const FllOptions& options, double cn0_dbhz);

/// Samples of a loop's error, valid for any output rate: the exact discrete form of a first-order loop, whose
/// closed loop w / (s + w) has the one-sided noise bandwidth Bn = integral of |H|^2 df = w / 4, so that
/// errors tau apart correlate by e^(-4 Bn tau). Loops of higher order have the same Bn and sigma, but another
/// shape of the correlation.
class LoopNoise {
 public:
  /// Throws InputError for a bandwidth that is not above 0 and finite.
  LoopNoise(double loop_bandwidth_hz, RandomStream stream);

  /// Error `dt_s` >= 0 after the last call, in the unit of `sigma` >= 0, its present standard deviation. The
  /// first call samples the stationary distribution; 0 s gives the same multiple of sigma again. Throws
  /// InputError for a step or sigma that is negative or not finite.
  [[nodiscard]] double advance(double dt_s, double sigma);

 private:
  OuProcess process_;
};

/// Spectral separation coefficient [1/Hz] of an interference with a signal: the integral over the front end's
/// band of both power spectral densities, each of unit power over all frequencies (J. W. Betz, Navigation
/// 48(4), 2001; Kaplan & Hegarty, 2nd ed. 2006, 6.3: 1 / (Q Rc)). Codes have the smooth spectra of their
/// chips.
///   Tone: the signal's density there. Band: its mean over the band.
///   Chirp: over the lines of a saw-tooth sweep, 1 / period apart, each with the power by the Fresnel
///   integrals (J. R. Klauder et al., Bell System Technical Journal 39(4), 1960, whose two edges cause the
///   ripples); over 20,000 lines as Band.
///   Code: by Simpson's rule within 64 chip rates.
/// Relative error below 1e-3 (tests). @param carrier_hz of the signal
[[nodiscard]] double spectral_separation_per_hz(const Correlation& signal, double carrier_hz,
                                                const propagation::Spectrum& interference);

/// Power of a tone after a correlator over that with a smooth spectrum: a repeating code has lines, and over
/// an integration T the tone hits them or falls between. For random codes with `line_hz` between lines, N = T
/// line_hz repetitions: sin^2(pi d T) / (N sin^2(pi d / line_hz)), d from tone to carrier; mean 1, maximum N.
[[nodiscard]] double line_factor(double offset_hz, double line_hz, double integration_s);

/// Fraction of its power [0, 1] within a band.
[[nodiscard]] double fraction_within(const propagation::Spectrum& interference, double centre_hz,
                                     double bandwidth_hz);

/// Amplitude gain (0, 1] of a third-order stage for weak signals next to a strong one: y = a1 x + a3 x^3 has
/// a gain of a1 + 3/2 a3 A^2 next to the amplitude A, and compresses a single signal by 1 dB at A^2 = 0.145
/// |a1 / a3| (B. Razavi, RF Microelectronics, 2nd ed. 2012, 2.2.1: desensitisation). So the gain is 1 -
/// 0.2175 P / P1dB. From 4.6 P1dB on signals are blocked: the gain is 1e-3.
/// @param over_compression power of the strong one over that of 1 dB of compression, >= 0
[[nodiscard]] double small_signal_gain(double over_compression);

/// Gain of an antenna for a wave [1, power] over an isotropic one of the wave's own polarisation; half of a
/// linear wave's power is in each hand. @param band one that the antenna receives
[[nodiscard]] double gain_for(const signal::AntennaPattern& antenna, const propagation::Interference& wave,
                              signal::Band band);

}  // namespace canyon::tracking
