// Declared in canyon/heatmap/engine/map_source.hpp.
#include <fmt/format.h>

#include <cmath>

#include "canyon/geodesy/constants.hpp"
#include "canyon/heatmap/engine/map_source.hpp"

namespace canyon::heatmap {

double projection_scale(const geodesy::LocalFrame& frame) {
  constexpr double kEccentricitySquared = geodesy::kFlattening * (2 - geodesy::kFlattening);
  const double sine = std::sin(frame.origin().latitude_rad);
  const double radius = geodesy::kSemiMajorAxis * std::sqrt(1 - kEccentricitySquared) /
                        (1 - kEccentricitySquared * sine * sine);
  return 1 + frame.origin().height_m / radius;
}

std::string projection(const geodesy::LocalFrame& frame) {
  const std::string origin = fmt::format("{:.12f}", geodesy::degrees(frame.origin().latitude_rad));
  const std::string meridian = fmt::format("{:.12f}", geodesy::degrees(frame.origin().longitude_rad));
  const std::string tail =
      fmt::format("+k={:.12f} +x_0=0 +y_0=0 +datum=WGS84 +units=m +no_defs", projection_scale(frame));
  const double heading_deg = std::remainder(geodesy::degrees(frame.heading_rad()), 360.0);
  if (heading_deg == 0) return fmt::format("+proj=tmerc +lat_0={} +lon_0={} {}", origin, meridian, tail);
  // The rectified grid's y axis points to azimuth alpha - gamma (EPSG Guidance Note 7-2, 3.2.4), the city's
  // to minus its heading. At alpha = 0 PROJ has no answer; any other line through the origin serves as well.
  constexpr double kAlphaDeg = 45;
  return fmt::format("+proj=omerc +lat_0={} +lonc={} +alpha={} +gamma={:.12f} {}", origin, meridian,
                     kAlphaDeg, std::remainder(kAlphaDeg + heading_deg, 360.0), tail);
}

}  // namespace canyon::heatmap
