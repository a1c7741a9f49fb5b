#pragma once

#include "canyon/broadcast/bits.hpp"
#include "canyon/gnss/navigation_data.hpp"

// Fields that CNAV (IS-GPS-200 30.3.3), CNAV-2 (IS-GPS-800 3.5) and B-CNAV (BDS-SIS-ICD-B1C-1.0, 7) have
// alike.

namespace canyon::broadcast {

/// The nearest whole 300 s in the week of `t`.
[[nodiscard]] geodesy::GpsTime whole_300_s(geodesy::GpsTime t);
/// The same orbit and clock by the elements of `toe` and the polynomial of `toc`.
/// @param toe in the week of the ephemeris' own @param earth_gm of the system [m^3/s^2]
[[nodiscard]] gnss::KeplerEphemeris referred_to(gnss::KeplerEphemeris e, geodesy::GpsTime toe,
                                                geodesy::GpsTime toc, double earth_gm);

/// A time of the week in 300 s: 11 bits.
void put_reference_time(Bits& bits, geodesy::GpsTime t);
/// 190 bits: semi-major axis less a reference, its rate, mean motion difference, its rate, mean anomaly,
/// eccentricity, argument of perigee.
void put_ellipse(Bits& bits, const gnss::KeplerEphemeris& e, double reference_m);
/// 203 bits and those of the node's rate [rad/s]: node, inclination, their rates, Cis, Cic, Crs, Crc, Cus,
/// Cuc.
void put_plane(Bits& bits, const gnss::KeplerEphemeris& e, double node_rate, int node_rate_bits);
/// UTC is the system's time less whole seconds, no leap second announced: 94 bits and those of the day of the
/// week.
void put_utc(Bits& bits, int leap_seconds, int week, int day, int day_bits);

}  // namespace canyon::broadcast
