#pragma once

#include <GeographicLib/UTMUPS.hpp>

#include "canyon/base/geodesy/frames.hpp"

namespace canyon::test {

/// Inverse of geodesy::utm_from_geodetic(), on the ellipsoid.
inline geodesy::Geodetic geodetic_from_utm(const geodesy::Utm& utm) {
  double latitude_deg = 0, longitude_deg = 0;
  GeographicLib::UTMUPS::Reverse(utm.zone, utm.north, utm.easting_m, utm.northing_m, latitude_deg,
                                 longitude_deg);
  return geodesy::Geodetic::from_degrees(latitude_deg, longitude_deg, 0);
}

}  // namespace canyon::test
