#pragma once

#include <complex>

namespace canyon::signal {

/// Reflection of a plane wave from air at a plane surface, time dependence exp(+j w t). Angles of incidence
/// theta are between ray and normal, [0, pi/2]; eta is the complex relative permittivity, eta'' >= 0 in eta =
/// eta' - j eta''. InputError outside.
///
/// Fields are taken in the right-handed triad (s, p, k) of each ray: k along the propagation, s = k x n
/// normalised (perpendicular to the plane of incidence, the same before and after), p = k x s. With these
/// signs, P.2040's, the two coefficients are opposite at normal incidence and both -1 at grazing.
struct LinearReflection {
  std::complex<double> perpendicular;  ///< E along s: TE, horizontal over ground
  std::complex<double> parallel;       ///< E along p: TM, vertical over ground
};

/// Half space, ITU-R P.2040-3, 2.2.1.5 (incident wave in air): with w = sqrt(eta - sin^2 theta)
///   R_perpendicular = (cos theta - w) / (cos theta + w)
///   R_parallel = (eta cos theta - w) / (eta cos theta + w).
/// Relative error below 1e-14 (that of the arithmetic), grazing angles included.
[[nodiscard]] LinearReflection reflect_half_space(std::complex<double> eta, double incidence_rad);

/// Reflection and transmission of a slab in air.
struct SlabResponse {
  LinearReflection reflected;
  LinearReflection transmitted;
};

/// Slab with air on both sides, ITU-R P.2040-3, 2.2.2.2 (simplified method for a single layer): with R' of
/// the half space and q = (2 pi d / lambda) sqrt(eta - sin^2 theta)
///   R = R' (1 - e^(-2jq)) / (1 - R'^2 e^(-2jq)),  T = (1 - R'^2) e^(-jq) / (1 - R'^2 e^(-2jq)).
/// The phase of R refers to the front surface; T to the same plane (the slab's far side by q).
/// @param thickness_m d >= 0; 0 reflects nothing
/// @param wavelength_m in vacuum, > 0
[[nodiscard]] SlabResponse slab(std::complex<double> eta, double incidence_rad, double thickness_m,
                                double wavelength_m);

/// Reflection of a right-hand circular wave (RHCP, IEEE sense): co in the same hand, cross in the other. The
/// same two coefficients hold for an incident LHCP wave. Circular axes e_R = (s - j p) / sqrt(2), e_L = (s +
/// j p) / sqrt(2):
///   co = (R_perpendicular + R_parallel) / 2,  cross = (R_perpendicular - R_parallel) / 2.
/// Metal turns RHCP into LHCP (co 0, cross -1); above the Brewster angle co is the stronger one; |co|^2 +
/// |cross|^2 is the reflected share of the power.
struct CircularReflection {
  std::complex<double> co;
  std::complex<double> cross;
};
[[nodiscard]] CircularReflection circular(const LinearReflection& linear);

/// A wave in its circular components, axes as in CircularReflection.
struct CircularWave {
  std::complex<double> rhcp = 1;
  std::complex<double> lhcp = 0;
};

/// `wave` after a reflection. `plane_turn_rad`: from the s axis of the reflection before to the s axis of
/// this one about the ray between them (plane_turn_rad()); 0 for the first. A turn by phi is e^(-j phi) on
/// RHCP and e^(+j phi) on LHCP.
[[nodiscard]] CircularWave reflect(const CircularWave& wave, const CircularReflection& reflection,
                                   double plane_turn_rad = 0);

/// Share (0, 1] of the specular amplitude that a rough surface keeps: exp(-2 (k sigma cos theta)^2), k = 2 pi
/// / lambda, for heights of normal distribution (Rayleigh roughness factor: W. S. Ament, Proc. IRE 41 (1953)
/// 142; Beckmann & Spizzichino 1963, 5.3). The rest is scattered. It is a lower bound for very rough walls.
/// @param height_sigma_m standard deviation of the heights, >= 0
[[nodiscard]] double roughness_factor(double height_sigma_m, double incidence_rad, double wavelength_m);

}  // namespace canyon::signal
