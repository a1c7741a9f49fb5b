#pragma once

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::test {

/// Every field of a message has a different value. @param id "G05"
inline gnss::KeplerEphemeris sample_ephemeris(const char* id, geodesy::GpsTime toe) {
  gnss::KeplerEphemeris e;
  e.id = *gnss::parse_satellite(id);
  e.toe = e.toc = toe;
  e.af0 = -1.5e-4;
  e.af1 = 3e-12;
  e.sqrt_a = 5153.7;
  e.eccentricity = 0.0123;
  e.inclination = 0.96;
  e.inclination_rate = -2e-10;
  e.right_ascension = -2.1;
  e.right_ascension_rate = -8e-9;
  e.argument_of_perigee = 1.7;
  e.mean_anomaly = -0.3;
  e.mean_motion_difference = 4.5e-9;
  e.cuc = -1e-6;
  e.cus = 2e-6;
  e.cic = -3e-8;
  e.cis = 4e-8;
  e.crc = 250.5;
  e.crs = -80.25;
  e.group_delay = {-1.1e-8, 5e-9};
  e.iode = 77;
  e.iodc = 77;
  e.accuracy_m = 2;
  e.data_sources = 1 << 0 | 1 << 9;
  return e;
}

}  // namespace canyon::test
