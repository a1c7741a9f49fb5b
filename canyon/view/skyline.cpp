#include "canyon/view/skyline.hpp"

#include <cmath>

#include "canyon/drawing/views/sky_mask.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/output/view_tables.hpp"

namespace canyon::view {

std::string skyline_bytes(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna_enu) {
  const drawing::SkyMask mask = drawing::make_sky_mask(scene, antenna_enu, output::kSkylineSectors);
  std::string bytes;
  for (const auto& stretches : mask.azimuths) {
    const double high_rad = stretches.empty() ? 0 : stretches.back().high_rad;
    bytes += static_cast<char>(std::lround(2 * geodesy::degrees(high_rad)));
  }
  return bytes;
}

bool MovingSkyline::move(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna_enu) {
  if (!bytes_.empty() && (antenna_enu - place_).norm() < step_m_) return false;
  place_ = antenna_enu;
  bytes_ = skyline_bytes(scene, antenna_enu);
  return true;
}

int Skylines::row_at(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna_enu) {
  if (skyline_.move(scene, antenna_enu)) rows_.add_bytes(skyline_.bytes());
  return static_cast<int>(rows_.size()) - 1;
}

}  // namespace canyon::view
