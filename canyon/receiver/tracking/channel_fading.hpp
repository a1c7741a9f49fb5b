#pragma once

#include <Eigen/Core>
#include <complex>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/paths/propagation/paths.hpp"
#include "canyon/receiver/tracking/noise.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::tracking {

/// Random carrier phases of paths: phi0 uniform on (-pi, pi], by seed, receiver, satellite and reflector
/// alone, since no city model has walls accurate to centimetres. The phase of the detour, -2 pi excess /
/// wavelength, is in signal::path_amplitude(): the exact integral of the fading, without memory. Const,
/// thread-safe.
class PathPhases {
 public:
  PathPhases(std::uint64_t seed, std::string_view receiver);

  /// [rad]. @param satellite e.g. "G05"; @param reflector a number that is constant while the signal comes
  /// over the same surface
  [[nodiscard]] double phase_rad(std::string_view satellite, std::uint64_t reflector) const;

 private:
  std::uint64_t seed_;
  std::string prefix_;
};

/// Frequency of a path relative to the tracked one [Hz], -excess_rate / wavelength, excess_rate the rate of
/// the difference of their lengths: SignalPath::fading_hz.
[[nodiscard]] inline double fading_rate_hz(double excess_rate_mps, double wavelength_m) {
  return -excess_rate_mps / wavelength_m;
}

/// Distance [wavelengths] at which the autocorrelation of a diffuse cluster's amplitude is 1/e: J0(2 pi d /
/// wavelength) = 1/e, for waves from all around (R. H. Clarke, Bell System Technical Journal 47(6), 1968).
inline constexpr double kCoherenceWavelengths = 0.27884;

/// A process of unit power with autocorrelation Re[e^(-s |tau|)], s = 1/tau_c - j 2 pi f: a cluster of waves
/// that decays in tau_c around an offset f from the carrier. Closed forms, exact.
///
/// Mean power [1] after a coherent integration over T: 2 Re[1/x - (1 - e^-x) / x^2], x = s T; for tau_c
/// infinite it is sinc^2(pi f T).
[[nodiscard]] double integrated_power(std::complex<double> s_per_s, double integration_s);
/// Fraction of the power [1] that a first-order filter of one-sided noise bandwidth Bn passes: Re[k / (k +
/// s)], k = 4 Bn; for tau_c infinite it is that of docs/tracking.md, 1 / (1 + (2 pi f / 4 Bn)^2).
[[nodiscard]] double filtered_fraction(std::complex<double> s_per_s, double loop_bandwidth_hz);

/// A cluster as a single wave for a code loop (CodeTracker): it fades with `frequency_hz`, low enough to
/// correct the loss of its integration.
struct ClusterWeight {
  double frequency_hz = 0;
  double coherent = 1;    ///< fraction of the power that passes the loop's filter
  double integrated = 1;  ///< fraction of the power after integration

  /// Power over the cluster's mean: the part that fades within the loop's memory counts with its mean power,
  /// the rest with its present power over the mean.
  [[nodiscard]] double power(double present) const {
    return integrated * (coherent * present + (1 - coherent));
  }
};
/// Weights of a process with the cluster's Doppler spread.
[[nodiscard]] ClusterWeight cluster_weight(std::complex<double> s_per_s, double loop_bandwidth_hz,
                                           double integration_s);

/// Random factors of a satellite's paths while they exist: of a mirror e^(j phi0) (PathPhases); of a diffuse
/// cluster a complex Gaussian of mean power 1 (Rayleigh amplitude), Gauss-Markov over the antenna's motion.
class PathFades {
 public:
  /// @param satellite "G05"; `stream` is used for clusters only
  PathFades(std::string satellite, RandomStream stream);

  /// Call before the factors of an epoch; paths not used since the last call are dropped.
  void next_epoch();
  void clear();
  /// e^(j phi0), constant for a reflector.
  [[nodiscard]] std::complex<double> fixed(const PathPhases& phases, std::uint64_t reflector);
  /// A cluster's factor after its autocorrelation decayed by e^-decay, decay >= 0, since the previous epoch;
  /// a new cluster gets a new sample.
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

/// d/dt [m/s] of geometric range plus excess path along one path, per second of true time.
///
/// From the light-time equation r = |S(t - r/c) - x(t)|: r' = e.(V - v) / (1 + e.(V + omega x S)/c), S and V
/// rotated to the axes of reception. For a path over a fixed reflector, the antenna's velocity counts along
/// the direction of arrival `a` in place of e. Its excess also changes with e while the satellite moves:
///   a plane, excess 2 h (n.e), n along e - a: 2 h n.e' = 2 excess (e - a).e' / |e - a|^2;
///   a point of an edge or a rough facade at distance d, excess d (1 - e.a): -d a.e', which is equal
/// (centimetres per second). Two planes have e' times the vector from the antenna's image in both to the
/// antenna (propagation::antenna_image()). A transmitter's path has its own rate, of its carrier. Within 1
/// mm/s of differences of ranges (receiver_test.cpp).
/// @param antenna_velocity_ecef [m/s], in the rotating frame; @param path in the frame that `ecef_from_enu`
/// rotates. For the scattering centre of a rough facade (Path::scattering_offset) the velocity counts along
/// its direction.
[[nodiscard]] double path_rate_mps(const orbit::LineOfSight& line,
                                   const Eigen::Vector3d& antenna_velocity_ecef,
                                   const propagation::Path& path, const Eigen::Matrix3d& ecef_from_enu);

}  // namespace canyon::tracking
