#pragma once

#include <complex>

namespace canyon::propagation {

/// Fresnel cosine and sine integrals C(x) + j S(x) = int_0^x exp(j pi s^2 / 2) ds: ITU-R P.526-15 (10/2019),
/// 2.7, F_c. Power series below |x| = 1.6 (Abramowitz & Stegun 7.3.11, 7.3.13), above it the continued
/// fraction of erfc (A&S 7.1.14 with 7.3.22). Absolute error below 1e-14 up to |x| = 50 (as measured: 9e-16),
/// 1e-13 beyond; +-(0.5 + 0.5j) at infinity. x must not be NaN (InputError).
[[nodiscard]] std::complex<double> fresnel_integral(double x);

/// Field of a knife edge over the field without it [1], relative to the phase of the direct path, time
/// dependence exp(+j w t): (1 + j)/2 int_nu^inf exp(-j pi s^2 / 2) ds = (1 + j)/2 ((1/2 - C) - j (1/2 - S))
/// (P.526-15, 4.1). nu > 0: the edge blocks the direct path; 1/2 at nu = 0; 1 for nu -> -inf, with the ripple
/// of the first Fresnel zones between. The phase includes that of the detour: far in the shadow it is that of
/// exp(-j pi nu^2 / 2) = exp(-2 pi j excess / lambda), so no further phase may be added for the excess path.
/// Relative error below 1e-13 from nu = -50 to 50 (as measured: 5e-15), deep shadow included.
[[nodiscard]] std::complex<double> knife_edge_field(double nu);

/// The part of knife_edge_field() that comes from the edge: the whole field in the shadow (nu >= 0); field -
/// 1 in the light, where the direct path is separate. |edge wave| is even in nu, at most 1/2.
[[nodiscard]] std::complex<double> edge_wave(double nu);

/// J(nu) [dB] as P.526-15, 4.1 approximates it: 6.9 + 20 log10(sqrt((nu - 0.1)^2 + 1) + nu - 0.1) for nu >
/// -0.78, else 0. Within 0.124 dB of the exact -20 log10 |knife_edge_field(nu)| above -0.78, 1.37 dB below.
[[nodiscard]] double approximate_knife_edge_loss_db(double nu);

/// T(m, n) [dB], >= 0: additional loss of an edge rounded with radius R over the knife edge (P.526-15, 4.2),
/// the satellite infinitely far. With k = pi R / lambda, d the leg from antenna to edge, theta the angle by
/// which the ray bends: m = R / d k^(-1/3), m n = theta k^(1/3).
/// @param radius_m >= 0 (0: no loss), @param leg_m > 0, @param bending_rad [0, pi]; InputError outside.
[[nodiscard]] double rounded_edge_loss_db(double radius_m, double leg_m, double bending_rad,
                                          double wavelength_m);

/// nu of an edge whose ray is longer than the straight line by `excess_m` >= 0, |nu| = 2 sqrt(excess /
/// lambda) (P.526-15, 4.1: nu = sqrt(2 h theta / lambda), with the detour h theta / 2; it is the argument of
/// Sommerfeld's half plane at any angle). Negative unless `blocked`. InputError for a negative excess or
/// wavelength <= 0.
[[nodiscard]] double signed_knife_edge_nu(double excess_m, double wavelength_m, bool blocked);

}  // namespace canyon::propagation
