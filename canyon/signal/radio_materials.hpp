#pragma once

#include <complex>
#include <cstdint>

#include "canyon/city/fwd.hpp"

namespace canyon::signal {

/// Electrical properties of a building material by ITU-R P.2040-3 (08/2023), 2.1.4 and table 3:
///   eps' = a f^b,  sigma = c f^d [S/m],  f in GHz,
/// curves through measurements of non-magnetic materials; single walls differ from them by tens of percent
/// (moisture, composition).
struct RadioMaterial {
  double a = 1, b = 0, c = 0, d = 0;
  double min_ghz = 1, max_ghz = 100;  ///< that the measurements behind the curve cover
  /// Thickness of the slab that stands for a facade of this material [m]; 0: a half space. These are Canyon's
  /// assumptions, not P.2040's; docs/propagation.md gives the reason of each.
  double default_thickness_m = 0;
};

/// Rows of table 3: Concrete, Glass (0.1 to 100 GHz), Brick, Metal, Wood by their names; Stone: marble;
/// Plaster: plasterboard; Ground: medium dry ground; Unknown: concrete. Foliage is air: it scatters and
/// attenuates (foliage.hpp) but makes no mirror.
[[nodiscard]] RadioMaterial radio_material(city::Material material);

/// eps', the real part of the relative permittivity [1].
/// @param frequency_hz 1 to 10 GHz, where all rows but none beyond are valid; else InputError
[[nodiscard]] double relative_permittivity(const RadioMaterial& material, double frequency_hz);
/// sigma [S/m], like relative_permittivity().
[[nodiscard]] double conductivity_s_per_m(const RadioMaterial& material, double frequency_hz);
/// eta = eps' - j sigma / (2 pi f eps0) [1] for the time dependence exp(+j w t) (P.2040-3, 2.1.2: eta''
/// = 17.98 sigma / f_GHz), like relative_permittivity().
[[nodiscard]] std::complex<double> complex_permittivity(const RadioMaterial& material, double frequency_hz);

/// Wavelength in vacuum [m]. Throws InputError unless the frequency is finite and > 0.
[[nodiscard]] double wavelength_m(double frequency_hz);

/// Attenuation by vegetation, ITU-R P.833-9 (09/2016).
enum class FoliageModel : std::uint8_t {
  /// 2.1, equation (1): A = A_m (1 - exp(-d gamma / A_m)), saturating. Specific attenuation gamma [dB/m] and
  /// maximum A_m [dB] as measured in a mixed forest near St Petersburg (table there): 0.17 dB/m, 26.5 dB at
  /// 949
  /// MHz and 0.30 dB/m, 29.0 dB at 1852.2 MHz; power laws between the rows.
  Woodland,
  /// 2.2, satellite slant paths: L = 0.25 f^0.39 d^0.25 theta^0.05, f in MHz, d in metres, theta the
  /// elevation
  /// in degrees: the fit to measurements in an Austrian pine wood. Steep at small depths (a metre is 5 dB),
  /// flat beyond.
  SlantPath,
};

/// Median loss [dB] of a path through foliage.
/// @param depth_m of vegetation along the ray, >= 0; 0 loses nothing
/// @param frequency_hz 105.9e6 to 2117.5e6 (the table's)
/// @param elevation_rad of the ray, [-pi/2, pi/2]; SlantPath takes 1 degree for less
/// InputError outside.
[[nodiscard]] double foliage_loss_db(FoliageModel model, double depth_m, double frequency_hz,
                                     double elevation_rad);

}  // namespace canyon::signal
