#pragma once

#include <cstdint>

namespace canyon::signal {

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
