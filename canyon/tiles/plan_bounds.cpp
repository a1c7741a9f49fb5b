#include "canyon/tiles/plan_bounds.hpp"

namespace canyon::tiles {

Eigen::AlignedBox2d plan_bounds(const std::vector<Eigen::Vector3d>& vertices,
                                const city::TriangleIndices& triangles) {
  Eigen::AlignedBox2d bounds(Eigen::Vector2d::Constant(1e300), Eigen::Vector2d::Constant(-1e300));
  for (const auto& triangle : triangles) {
    for (const std::uint32_t v : triangle) bounds.extend(Eigen::Vector2d(vertices[v].head<2>()));
  }
  return bounds;
}

}  // namespace canyon::tiles
