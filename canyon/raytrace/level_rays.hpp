#pragma once

#include <algorithm>
#include <array>

#include "canyon/geodesy/constants.hpp"

// The rule by which a place under a roof counts as inside a building, for every tracer:
// RayScene::placement() casts them, heat maps count them for all cells at once.

namespace canyon::raytrace {

/// Surfaces nearer above a place than this do not cover it [m].
inline constexpr double kSkin_m = 1e-3;

inline constexpr int kLevelRays = 7;
/// From north, clockwise [rad]; odd ones, so that none runs along the walls of a street grid.
/// @param i in [0, kLevelRays)
[[nodiscard]] constexpr double level_ray_azimuth_rad(int i) {
  return 0.2137 + i * (2 * geodesy::kPi / kLevelRays);
}

/// Whether most of the rays say that they leave a building, or most that they enter one (it is inside out).
/// @param leaves walls that each ray meets from behind less those that it meets from the front
[[nodiscard]] inline bool is_inside(const std::array<int, kLevelRays>& leaves) {
  const auto inside = std::count_if(leaves.begin(), leaves.end(), [](int walls) { return walls > 0; });
  const auto inside_out = std::count_if(leaves.begin(), leaves.end(), [](int walls) { return walls < 0; });
  return std::max(inside, inside_out) > kLevelRays / 2;
}

}  // namespace canyon::raytrace
