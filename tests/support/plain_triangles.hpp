#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "canyon/city/city.hpp"

namespace canyon::test {

/// A mesh as reference for the engine's rays: every triangle tested alone, in doubles, without acceleration,
/// with its own ray-triangle test (Moeller and Trumbore 1997).
struct PlainTriangles {
  using Vector3d = Eigen::Vector3d;

  struct Triangle {
    Vector3d a, b, c, normal;
    bool reflects;
  };

  /// Range of the ray to the triangle, negative: no hit.
  [[nodiscard]] static double range_to(const Triangle& t, const Vector3d& origin, const Vector3d& direction) {
    const Vector3d ab = t.b - t.a, ac = t.c - t.a, p = direction.cross(ac);
    const double determinant = ab.dot(p);
    if (std::abs(determinant) < 1e-15) return -1;
    const Vector3d to_origin = origin - t.a;
    const double u = to_origin.dot(p) / determinant;
    if (u < -1e-12 || u > 1 + 1e-12) return -1;
    const Vector3d q = to_origin.cross(ab);
    const double v = direction.dot(q) / determinant;
    if (v < -1e-12 || u + v > 1 + 1e-12) return -1;
    return ac.dot(q) / determinant;
  }

  std::vector<Triangle> triangles;

  explicit PlainTriangles(const city::Mesh& mesh) {
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto& t = mesh.triangles[i];
      Triangle triangle{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], {}, false};
      triangle.normal = (triangle.b - triangle.a).cross(triangle.c - triangle.a).normalized();
      triangle.reflects = mesh.surface_of(i) == city::Surface::Building;
      triangles.push_back(triangle);
    }
  }

  /// Anything between 1 mm from the origin and 1 mm before the end.
  [[nodiscard]] bool hidden(const Vector3d& origin, const Vector3d& direction, double length) const {
    return std::any_of(triangles.begin(), triangles.end(), [&](const Triangle& t) {
      const double range = range_to(t, origin, direction);
      return range > 1e-3 && range < length - 1e-3;
    });
  }
};

}  // namespace canyon::test
