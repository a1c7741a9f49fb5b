#pragma once

#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/navigation_data.hpp"

namespace canyon::errors {

/// Broadcast ionosphere delay [m] on `frequency_hz` (IS-GPS-200, 20.3.3.5.2.5; scaled from L1 by f^-2).
/// 0 at or below the horizon.
[[nodiscard]] double klobuchar_delay_m(const gnss::Klobuchar& model, geodesy::GpsTime t,
                                       const geodesy::Geodetic& receiver, double azimuth_rad,
                                       double elevation_rad, double frequency_hz);

/// Saastamoinen troposphere delay [m] in the standard atmosphere with 70 % humidity at the receiver's height
/// (as RTKLIB's tropmodel from -100 m to 10 km, where that ends). Continuous in height: below sea level that
/// of sea level, above 11 km falling by 1/e in 6.3 km. 0 at or below the horizon.
[[nodiscard]] double saastamoinen_delay_m(const geodesy::Geodetic& receiver, double elevation_rad,
                                          double relative_humidity = 0.7);
/// The same at the zenith [m].
[[nodiscard]] double saastamoinen_zenith_m(const geodesy::Geodetic& receiver, double relative_humidity = 0.7);
/// A zenith delay as Saastamoinen maps it: over sin(elevation). 0 at or below the horizon.
[[nodiscard]] double slant_delay_m(double zenith_m, double elevation_rad);

}  // namespace canyon::errors
