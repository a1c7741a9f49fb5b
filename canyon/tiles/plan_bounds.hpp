#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "canyon/city/city.hpp"

namespace canyon::tiles {

/// Bounds of triangles seen from above: x and y of their corners. Without triangles it is empty, from 1e300
/// to -1e300.
[[nodiscard]] Eigen::AlignedBox2d plan_bounds(const std::vector<Eigen::Vector3d>& vertices,
                                              const city::TriangleIndices& triangles);

}  // namespace canyon::tiles
