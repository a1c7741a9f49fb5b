#pragma once

#include <set>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

namespace canyon::orbit {

/// Broadcast ephemerides of the nominal constellations, computed for any date from the published slot tables:
/// GPS 24 expandable slots (SPS Performance Standard 5th ed., table 3.2-1; unexpanded), GLONASS 24/3/1,
/// Galileo 24/3/1, BeiDou-3 24/3/1 MEO, 3 IGSO, 3 GEO. Clocks are perfect, group delays zero, all healthy.
/// Records have each system's usual spacing, so that every instant of [begin, end] is within validity, and
/// successive records describe one continuous orbit (jumps below 1 mm). Klobuchar's coefficients are
/// standard_ionosphere(). QZSS and SBAS in `systems` are ignored, because they have no slots here.
/// Throws InputError if end < begin, the span exceeds 60 days, or no system is left.
[[nodiscard]] gnss::NavigationData nominal_constellation(geodesy::GpsTime begin, geodesy::GpsTime end,
                                                         const std::set<gnss::System>& systems);

/// Solar flux at 10.7 cm for medium activity [sfu].
inline constexpr double kMediumSolarFlux_sfu = 100;
/// The mean of the date's year observed in Penticton [sfu]; medium activity for years without one.
[[nodiscard]] double mean_solar_flux_sfu(geodesy::GpsTime date);
/// Klobuchar's coefficients broadcast by GPS on 2004-01-01, which RTKLIB uses if a file has none (ionmodel()
/// of rtkcmn.c), with amplitudes proportional to the solar flux: noon zenith delays of seven broadcast sets
/// of 2012 to 2024 are within 40 % of it from 0 to 45 deg of latitude.
[[nodiscard]] gnss::Klobuchar standard_ionosphere(double solar_flux_sfu = kMediumSolarFlux_sfu);

/// One slot of a nominal constellation: a circular orbit described relative to the rotating Earth, so that
/// its repeating ground track does not depend on UT1 minus GPST or on precession.
struct OrbitSlot {
  gnss::SatelliteId id;
  geodesy::GpsTime epoch;        ///< of the two angles
  double semi_major_axis_m = 0;  ///< as published; the phase follows the rate below
  double inclination_rad = 0;
  double node_longitude_rad = 0;                    ///< of the ascending node, ECEF, at `epoch`
  double node_rate = 0;                             ///< of the right ascension of the node [rad/s]
  double earth_rate = geodesy::kEarthRotationRate;  ///< from the system's user algorithm [rad/s]
  double argument_of_latitude_rad = 0;              ///< at `epoch`
  double argument_of_latitude_rate = 0;             ///< [rad/s]
  int glonass_channel = 0;                          ///< frequency number, GLONASS only
  bool geostationary = false;  ///< over `node_longitude_rad`; the other angles are unused
};

/// Slots of a system in ascending order of satellite: GPS 24, GLONASS 24, Galileo 24, BeiDou 30, QZSS and
/// SBAS none. The sources of each table are in slot_tables.cpp and in docs/sky.md.
[[nodiscard]] std::vector<OrbitSlot> nominal_slots(gnss::System system);

}  // namespace canyon::orbit
