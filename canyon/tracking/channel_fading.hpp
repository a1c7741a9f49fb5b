#pragma once

#include <complex>
#include <cstdint>
#include <string>
#include <vector>

#include "canyon/tracking/noise.hpp"
#include "canyon/tracking/path_phase.hpp"

namespace canyon::tracking {

/// Distance that an antenna moves [wavelengths] until the autocorrelation of a diffuse bundle's amplitude
/// falls to 1/e: J0(2 pi d / wavelength) = 1/e, of waves from all around (R. H. Clarke, Bell System Technical
/// Journal 47(6), 1968).
inline constexpr double kCoherenceWavelengths = 0.27884;

/// A process of unit power with autocorrelation Re[e^(-s |tau|)], s = 1/tau_c - j 2 pi f: a bundle of waves
/// that decays in tau_c about an offset f from the carrier. Closed forms, exact.
///
/// Mean power [1] after a coherent integration over T: 2 Re[1/x - (1 - e^-x) / x^2], x = s T; for tau_c
/// infinite it is sinc^2(pi f T).
[[nodiscard]] double integrated_power(std::complex<double> s_per_s, double integration_s);
/// Share of the power [1] that a first-order filter of one-sided noise bandwidth Bn passes: Re[k / (k + s)],
/// k = 4 Bn; for tau_c infinite it is that of docs/tracking.md, 1 / (1 + (2 pi f / 4 Bn)^2).
[[nodiscard]] double filtered_share(std::complex<double> s_per_s, double loop_bandwidth_hz);

/// A bundle as a single wave for a code loop (CodeTracker): it fades with `frequency_hz`, low enough for the
/// loss of its integration to be undone.
struct BundleShare {
  double frequency_hz = 0;
  double coherent = 1;    ///< share of the power that passes the loop's filter
  double integrated = 1;  ///< share of the power that integration leaves

  /// Power over the bundle's mean: what fades within the loop's memory counts by its mean power, the rest by
  /// its present one, over the mean.
  [[nodiscard]] double power(double present) const {
    return integrated * (coherent * present + (1 - coherent));
  }
};
/// Shares of a process with the bundle's Doppler spread.
[[nodiscard]] BundleShare bundle_share(std::complex<double> s_per_s, double loop_bandwidth_hz,
                                       double integration_s);

/// Random factors of one satellite's paths, kept while a path is there: of a mirror e^(j phi0)
/// (PathPhases), of a diffuse bundle a complex Gaussian of mean power 1 (its amplitude is Rayleigh's), a
/// Gauss-Markov process over the antenna's path.
class PathFades {
 public:
  /// @param satellite "G05"; `stream` is used for bundles alone
  PathFades(std::string satellite, RandomStream stream);

  /// Before the factors of an epoch; paths that were not asked for since the last call are forgotten.
  void next_epoch();
  void clear();
  /// e^(j phi0), the same for a reflector at every time.
  [[nodiscard]] std::complex<double> fixed(const PathPhases& phases, std::uint64_t reflector);
  /// A bundle's factor after its autocorrelation decayed by e^-decay, decay >= 0, since the epoch before; a
  /// new bundle draws afresh.
  [[nodiscard]] std::complex<double> rayleigh(std::uint64_t reflector, double decay);

 private:
  struct Fade {
    std::uint64_t reflector = 0;
    bool diffuse = false;
    std::complex<double> value;
  };
  [[nodiscard]] const Fade* before(std::uint64_t reflector, bool diffuse) const;
  [[nodiscard]] std::complex<double> draw();

  std::string satellite_;
  RandomStream stream_;
  std::vector<Fade> before_, now_;
};

}  // namespace canyon::tracking
