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

/// Klobuchar's coefficients as GPS broadcast them on 2004-01-01, of medium solar activity; RTKLIB takes the
/// same where a file has none (ionmodel() of rtkcmn.c).
[[nodiscard]] gnss::Klobuchar standard_ionosphere();

}  // namespace canyon::orbit
