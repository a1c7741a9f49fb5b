#pragma once

#include <set>

#include "canyon/gnss/navigation_data.hpp"

namespace canyon::orbit {

/// Broadcast ephemerides of the nominal constellations, made for any date from the published slot tables:
/// GPS 24 expandable slots (SPS Performance Standard 5th ed., table 3.2-1; unexpanded), GLONASS 24/3/1,
/// Galileo 24/3/1, BeiDou-3 24/3/1 MEO, 3 IGSO, 3 GEO. Clocks are perfect, group delays zero, all healthy.
/// Records lie at each system's usual spacing so that every instant of [begin, end] is within validity, and
/// successive records describe one continuous orbit (jumps below 1 mm). Klobuchar's coefficients are
/// standard_ionosphere().
/// `systems` but QZSS and SBAS, which have no slots here and are ignored.
/// Throws InputError where end < begin, the span exceeds 60 days, or no system is left.
[[nodiscard]] gnss::NavigationData nominal_constellation(geodesy::GpsTime begin, geodesy::GpsTime end,
                                                         const std::set<gnss::System>& systems);

/// Solar flux at 10.7 cm of medium activity [sfu].
inline constexpr double kMediumSolarFlux_sfu = 100;
/// The mean of the date's year as observed in Penticton [sfu]; of years without one medium activity.
[[nodiscard]] double mean_solar_flux_sfu(geodesy::GpsTime date);
/// Klobuchar's coefficients as GPS broadcast them on 2004-01-01, which RTKLIB takes where a file has none
/// (ionmodel() of rtkcmn.c), with amplitudes in proportion to the solar flux: noon's zenith delays of seven
/// broadcast sets of 2012 to 2024 are within 40 % of it from 0 to 45 deg of latitude.
[[nodiscard]] gnss::Klobuchar standard_ionosphere(double solar_flux_sfu = kMediumSolarFlux_sfu);

}  // namespace canyon::orbit
