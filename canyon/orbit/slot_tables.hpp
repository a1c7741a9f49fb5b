#pragma once

#include <vector>

#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/satellite_id.hpp"

namespace canyon::orbit {

/// One slot of a nominal constellation: a circular orbit described in the rotating Earth, so that the repeat
/// of its ground track does not depend on the difference of UT1 and GPST or on precession.
struct Slot {
  gnss::SatelliteId id;
  geodesy::GpsTime epoch;        ///< of the two angles
  double semi_major_axis_m = 0;  ///< as published; the rate below is what the phase follows
  double inclination_rad = 0;
  double node_longitude_rad = 0;                    ///< of the ascending node, ECEF, at `epoch`
  double node_rate = 0;                             ///< of the right ascension of the node [rad/s]
  double earth_rate = geodesy::kEarthRotationRate;  ///< as the system's user algorithm has it [rad/s]
  double argument_of_latitude_rad = 0;              ///< at `epoch`
  double argument_of_latitude_rate = 0;             ///< [rad/s]
  int glonass_channel = 0;                          ///< frequency number, GLONASS only
  bool geostationary = false;  ///< over `node_longitude_rad`; the other angles are unused
};

/// Slots of a system in ascending order of satellite: GPS 24, GLONASS 24, Galileo 24, BeiDou 30, QZSS and
/// SBAS none.
/// Sources of each table stand in slot_tables.cpp and in docs/sky.md.
[[nodiscard]] std::vector<Slot> nominal_slots(gnss::System system);

}  // namespace canyon::orbit
