#pragma once

#include <Eigen/Core>

namespace canyon::city {

/// Twice the signed area of the triangle that two sides span, positive where v is to the left of u.
[[nodiscard]] inline double cross(const Eigen::Vector2d& u, const Eigen::Vector2d& v) {
  return u.x() * v.y() - u.y() * v.x();
}

}  // namespace canyon::city
