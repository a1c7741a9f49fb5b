#pragma once

// Reference shadows, not computed by rasterization; for tests and benchmarks.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "canyon/analysis/heatmap/kernels/shadows.hpp"
#include "canyon/city/city.hpp"

namespace canyon::heatmap::reference {

/// Centre of cell (column, row).
inline Eigen::Vector3d cell_point(const CellPlane& plane, std::uint32_t column, std::uint32_t row) {
  return {plane.first.x() + column * plane.spacing_m, plane.first.y() + row * plane.spacing_m, plane.z};
}

/// Range to the first triangle above the origin, each of them tested in doubles: T. Moeller, B. Trumbore,
/// "Fast, minimum storage ray/triangle intersection", J. Graphics Tools 2(1), 1997, eq. (6).
inline std::optional<double> first_hit(const city::Mesh& mesh, const Eigen::Vector3d& origin,
                                       const Eigen::Vector3d& direction) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d& corner = mesh.vertices[t[0]];
    const Eigen::Vector3d side1 = mesh.vertices[t[1]] - corner, side2 = mesh.vertices[t[2]] - corner;
    const Eigen::Vector3d p = direction.cross(side2);
    const double determinant = side1.dot(p);
    if (determinant == 0) continue;
    const Eigen::Vector3d from = origin - corner;
    const double u = from.dot(p) / determinant;
    const Eigen::Vector3d q = from.cross(side1);
    const double v = direction.dot(q) / determinant;
    const double range = side2.dot(q) / determinant;
    if (u >= 0 && v >= 0 && u + v <= 1 && range > 0) nearest = std::min(nearest, range);
  }
  if (std::isinf(nearest)) return std::nullopt;
  return nearest;
}

/// Distance of a half-line from a change of the result: to a side of a triangle, measured across the
/// half-line, or from its origin to a triangle. Metres; up to about 1 m is exact, else at least that.
inline double distance_to_edge(const city::Mesh& mesh, const Eigen::Vector3d& origin,
                               const Eigen::Vector3d& direction) {
  const Eigen::Vector3d across1 = direction.unitOrthogonal(), across2 = direction.cross(across1);
  double least = 1;
  for (const auto& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      Eigen::Vector3d a = mesh.vertices[t[static_cast<std::size_t>(k)]] - origin;
      Eigen::Vector3d b = mesh.vertices[t[static_cast<std::size_t>((k + 1) % 3)]] - origin;
      // The part of the side ahead of the origin.
      double along_a = a.dot(direction), along_b = b.dot(direction);
      if (along_a < 0 && along_b < 0) continue;
      if (along_a < 0) a += along_a / (along_a - along_b) * (b - a);
      if (along_b < 0) b += along_b / (along_b - along_a) * (a - b);
      const Eigen::Vector2d start(a.dot(across1), a.dot(across2)), end(b.dot(across1), b.dot(across2));
      const Eigen::Vector2d side = end - start;
      const double length2 = side.squaredNorm();
      const double fraction = length2 > 0 ? std::clamp(-start.dot(side) / length2, 0.0, 1.0) : 0.0;
      least = std::min(least, (start + fraction * side).norm());
    }
    const Eigen::Vector3d& a = mesh.vertices[t[0]];
    const Eigen::Vector3d &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const Eigen::Vector3d area = (b - a).cross(c - a);
    if (!(area.norm() > 0)) continue;
    const Eigen::Vector3d normal = area.normalized();
    const double height = normal.dot(origin - a);
    if (std::abs(height) >= least) continue;
    const Eigen::Vector3d foot = origin - height * normal;
    const bool within = (b - a).cross(foot - a).dot(normal) >= 0 &&
                        (c - b).cross(foot - b).dot(normal) >= 0 && (a - c).cross(foot - c).dot(normal) >= 0;
    if (within) least = std::abs(height);
  }
  return least;
}

}  // namespace canyon::heatmap::reference
