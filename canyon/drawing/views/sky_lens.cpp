#include "canyon/drawing/views/sky_lens.hpp"

#include <cmath>

#include "canyon/geodesy/constants.hpp"

namespace canyon::drawing {

std::string_view name(SkyProjection projection) {
  return projection == SkyProjection::Equidistant ? "equidistant" : "stereographic";
}

double SkyLens::reach(double elevation_rad) const {
  const double zenith_angle = 0.5 * geodesy::kPi - elevation_rad;
  return projection == SkyProjection::Equidistant ? zenith_angle / (0.5 * geodesy::kPi)
                                                  : std::tan(0.5 * zenith_angle);
}

Point SkyLens::point(double azimuth_rad, double elevation_rad) const {
  const double r = radius * reach(elevation_rad);
  const double east = r * std::sin(azimuth_rad);
  return {centre.x + (looking_up ? -east : east), centre.y - r * std::cos(azimuth_rad)};
}

std::optional<geodesy::AzimuthElevation> SkyLens::direction(const Point& at) const {
  const double x = (looking_up ? centre.x - at.x : at.x - centre.x) / radius;
  const double y = (centre.y - at.y) / radius;
  const double r = std::hypot(x, y);
  if (!(r <= 1)) return std::nullopt;
  const double zenith_angle =
      projection == SkyProjection::Equidistant ? r * 0.5 * geodesy::kPi : 2 * std::atan(r);
  const double azimuth = std::atan2(x, y);
  return geodesy::AzimuthElevation{azimuth < 0 ? azimuth + 2 * geodesy::kPi : azimuth,
                                   0.5 * geodesy::kPi - zenith_angle};
}

}  // namespace canyon::drawing
