#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "canyon/city/city.hpp"

namespace canyon::city {

inline void extend(Box& box, const Eigen::Vector3d& point) {
  box.min = box.min.cwiseMin(point);
  box.max = box.max.cwiseMax(point);
}

/// Extends a box by an object of a mesh.
inline void extend(Box& box, const Mesh& mesh, const Object& object) {
  for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
    for (const std::uint32_t v : mesh.triangles[t]) extend(box, mesh.vertices[v]);
  }
}

[[nodiscard]] inline Eigen::Vector3d middle_of(const Box& box) {
  return 0.5 * (box.min + box.max);
}

/// The area of a box from above; 0 for an empty one.
[[nodiscard]] inline double plan_area(const Box& box) {
  return std::max(0.0, box.max.x() - box.min.x()) * std::max(0.0, box.max.y() - box.min.y());
}

/// Twice the signed area of the triangle that two sides span, positive where v is to the left of u.
[[nodiscard]] inline double cross(const Eigen::Vector2d& u, const Eigen::Vector2d& v) {
  return u.x() * v.y() - u.y() * v.x();
}

}  // namespace canyon::city
