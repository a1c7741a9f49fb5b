#pragma once

#include <Eigen/Core>
#include <vector>

#include "canyon/city/raytrace/ray_scene.hpp"

namespace canyon::drawing {

/// Parts of the sky that the surroundings hide at one point: for each of `azimuths.size()` equal sectors,
/// starting at north and going clockwise, the hidden intervals of elevation.
struct SkyMask {
  struct Stretch {
    double low_rad = 0;  ///< elevations, 0 <= low < high <= pi/2
    double high_rad = 0;
  };
  std::vector<std::vector<Stretch>> azimuths;  ///< [sector], ascending

  [[nodiscard]] bool hidden(double azimuth_rad, double elevation_rad) const;
  /// Fraction of the upper half of the celestial sphere (solid angle) that is hidden.
  [[nodiscard]] double hidden_fraction() const;
};

/// Casts `sectors` x 180 rays, at the middles of the sectors and of half degrees of elevation, from a point
/// in the city's ENU frame, and refines each boundary by bisection to 0.01 deg. Gaps and obstacles lower than
/// half a degree may be missed; in azimuth the resolution is one sector. Sectors run in parallel; the mask
/// does not depend on the number of threads.
[[nodiscard]] SkyMask make_sky_mask(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna_enu,
                                    int sectors = 720);

}  // namespace canyon::drawing
