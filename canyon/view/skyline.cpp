#include "canyon/view/skyline.hpp"

#include <cmath>

#include "canyon/drawing/views/sky_mask.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/view/tables/tables.hpp"

namespace canyon::view {

std::string skyline_bytes(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna_enu) {
  const drawing::SkyMask mask = drawing::make_sky_mask(scene, antenna_enu, kSkylineSectors);
  std::string bytes;
  for (const auto& stretches : mask.azimuths) {
    const double high_rad = stretches.empty() ? 0 : stretches.back().high_rad;
    bytes += static_cast<char>(std::lround(2 * geodesy::degrees(high_rad)));
  }
  return bytes;
}

int Skylines::row_at(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna_enu) {
  if (rows_.empty() || !((antenna_enu - place_).norm() < step_m_)) {
    rows_.add_bytes(skyline_bytes(scene, antenna_enu));
    place_ = antenna_enu;
  }
  return static_cast<int>(rows_.size()) - 1;
}

}  // namespace canyon::view
