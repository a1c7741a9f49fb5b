#pragma once

#include <map>

#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/navigation_data.hpp"

namespace canyon::errors {

/// Broadcast ionosphere delay [m] on `frequency_hz` (IS-GPS-200, 20.3.3.5.2.5; scaled from L1 by f^-2).
/// 0 at or below the horizon.
[[nodiscard]] double klobuchar_delay_m(const gnss::Klobuchar& model, geodesy::GpsTime t,
                                       const geodesy::Geodetic& receiver, double azimuth_rad,
                                       double elevation_rad, double frequency_hz);

/// Coefficients, and the system that broadcasts them.
using SystemKlobuchar = std::map<gnss::System, gnss::Klobuchar>::value_type;
/// The same by the formula of the system that the coefficients are of: BeiDou's has geographic latitudes, a
/// shell at 375 km and its own limits, and is scaled from B1I (BDS-SIS-ICD-B1I-3.0, 5.2.4.7).
[[nodiscard]] double klobuchar_delay_m(const SystemKlobuchar& of_system, geodesy::GpsTime t,
                                       const geodesy::Geodetic& receiver, double azimuth_rad,
                                       double elevation_rad, double frequency_hz);

/// Troposphere delay [m]: Saastamoinen's zenith delay in the standard atmosphere with 70 % humidity at the
/// receiver's height (as RTKLIB's tropmodel from -100 m to 10 km, where that ends), as slant_delay_m() maps
/// it. Continuous in height: below sea level that of sea level, above 11 km falling by 1/e in 6.3 km. 0 at or
/// below the horizon.
[[nodiscard]] double saastamoinen_delay_m(const geodesy::Geodetic& receiver, double elevation_rad,
                                          double relative_humidity = 0.7);
/// The same at the zenith [m].
[[nodiscard]] double saastamoinen_zenith_m(const geodesy::Geodetic& receiver, double relative_humidity = 0.7);
/// A zenith delay as RTCA DO-229 maps it: within 1 % of Niell's mapping from 2.5 deg up. 0 at or below the
/// horizon.
[[nodiscard]] double slant_delay_m(double zenith_m, double elevation_rad);

}  // namespace canyon::errors
