#pragma once

#include <Eigen/Core>
#include <string>

#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::view {

/// A row of the table "skylines" at a place in the city's frame [m, east north up]: kSkylineSectors bytes
/// from north clockwise, half degrees of the highest hidden elevation.
[[nodiscard]] std::string skyline_bytes(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna_enu);

}  // namespace canyon::view
