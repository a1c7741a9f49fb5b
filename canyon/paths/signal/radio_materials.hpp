#pragma once

#include <complex>
#include <cstdint>

#include "canyon/city/fwd.hpp"

namespace canyon::signal {

/// Electrical properties of a building material by ITU-R P.2040-3 (08/2023), 2.1.4 and table 3:
///   eps' = a f^b,  sigma = c f^d [S/m],  f in GHz,
/// fits to measurements of non-magnetic materials; single walls differ from them by tens of percent
/// (moisture, composition).
struct RadioMaterial {
  double a = 1, b = 0, c = 0, d = 0;
  /// Thickness of the slab that represents a facade of this material [m]; 0: a half space. These are Canyon's
  /// assumptions, not P.2040's; docs/propagation.md gives the reason for each.
  double default_thickness_m = 0;
};

/// Rows of table 3: Concrete, Glass (0.1 to 100 GHz), Brick, Metal, Wood by their names; Stone: marble;
/// Plaster: plasterboard; Ground: medium dry ground; Unknown: concrete. Foliage is air: it scatters and
/// attenuates (foliage_loss_db()) but does not reflect.
[[nodiscard]] RadioMaterial radio_material(city::Material material);

/// eta = eps' - j sigma / (2 pi f eps0) [1] for the time dependence exp(+j w t) (P.2040-3, 2.1.2: eta''
/// = 17.98 sigma / f_GHz).
/// @param frequency_hz 1 to 10 GHz, the common range of all rows; else InputError
[[nodiscard]] std::complex<double> complex_permittivity(const RadioMaterial& material, double frequency_hz);

/// Wavelength in vacuum [m]. Throws InputError unless the frequency is finite and > 0.
[[nodiscard]] double wavelength_m(double frequency_hz);

/// Attenuation by vegetation, ITU-R P.833-9 (09/2016).
enum class FoliageModel : std::uint8_t {
  /// 2.1, equation (1): A = A_m (1 - exp(-d gamma / A_m)), saturating. Specific attenuation gamma [dB/m] and
  /// maximum A_m [dB] as measured in a mixed forest near St Petersburg (table there): 0.17 dB/m, 26.5 dB at
  /// 949 MHz and 0.30 dB/m, 29.0 dB at 1852.2 MHz; power laws between the rows.
  Woodland,
  /// 2.2, satellite slant paths: L = 0.25 f^0.39 d^0.25 theta^0.05, f in MHz, d in metres, theta the
  /// elevation in degrees: measured in an Austrian pine wood. Steep at first (a metre is 5 dB), then flat.
  SlantPath,
};

/// Median loss [dB] of a path through foliage.
/// @param depth_m of vegetation along the ray, >= 0; 0: no loss
/// @param frequency_hz 105.9e6 to 2117.5e6 (the table's)
/// @param elevation_rad of the ray, [-pi/2, pi/2]; SlantPath uses at least 1 degree
/// InputError outside.
[[nodiscard]] double foliage_loss_db(FoliageModel model, double depth_m, double frequency_hz,
                                     double elevation_rad);

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

/// Reflection by a slab with air on both sides, ITU-R P.2040-3, 2.2.2.2 (simplified method for a single
/// layer): with R' of the half space and q = (2 pi d / lambda) sqrt(eta - sin^2 theta)
///   R = R' (1 - e^(-2jq)) / (1 - R'^2 e^(-2jq)), its phase that at the front surface.
/// @param thickness_m d >= 0; 0 reflects nothing
/// @param wavelength_m in vacuum, > 0
[[nodiscard]] LinearReflection slab(std::complex<double> eta, double incidence_rad, double thickness_m,
                                    double wavelength_m);

/// Reflection of a right-hand circular wave (RHCP, IEEE sense): co in the same hand, cross in the other. The
/// same two coefficients hold for an incident LHCP wave. Circular axes e_R = (s - j p) / sqrt(2), e_L = (s +
/// j p) / sqrt(2):
///   co = (R_perpendicular + R_parallel) / 2,  cross = (R_perpendicular - R_parallel) / 2.
/// Metal reflects RHCP as LHCP (co 0, cross -1); above the Brewster angle co is the stronger one; |co|^2 +
/// |cross|^2 is the reflected fraction of the power.
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

/// `wave` after a reflection. `plane_rotation_rad`: rotation from the s axis of the previous reflection to
/// the s axis of this one about the ray between them (plane_rotation_rad()); 0 for the first. A rotation by
/// phi is e^(-j phi) on RHCP and e^(+j phi) on LHCP.
[[nodiscard]] CircularWave reflect(const CircularWave& wave, const CircularReflection& reflection,
                                   double plane_rotation_rad = 0);

}  // namespace canyon::signal
