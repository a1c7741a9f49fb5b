#include "canyon/city/primitive_meshes.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>

#include "canyon/geodesy/constants.hpp"

namespace canyon::city {

TriangleSet box_mesh(const Eigen::Vector3d& size) {
  TriangleSet set;
  for (int corner = 0; corner < 8; ++corner) {
    set.vertices.emplace_back(((corner & 1) != 0 ? 0.5 : -0.5) * size.x(),
                              ((corner & 2) != 0 ? 0.5 : -0.5) * size.y(),
                              ((corner & 4) != 0 ? 0.5 : -0.5) * size.z());
  }
  set.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return set;
}

TriangleSet cylinder_mesh(double radius, double length, int sides) {
  TriangleSet set;
  set.vertices = {{0, 0, -length / 2}, {0, 0, length / 2}};
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * geodesy::kPi * i / sides;
    for (const double z : {-length / 2, length / 2}) {
      set.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  }
  const auto n = static_cast<std::uint32_t>(sides);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t low = 2 + 2 * i;
    const std::uint32_t next = 2 + 2 * ((i + 1) % n);
    set.triangles.push_back({0, next, low});
    set.triangles.push_back({1, low + 1, next + 1});
    set.triangles.push_back({low, next, next + 1});
    set.triangles.push_back({low, next + 1, low + 1});
  }
  return set;
}

TriangleSet sphere_mesh(double radius, int sides) {
  TriangleSet set;
  set.vertices = {{0, 0, -radius}, {0, 0, radius}};
  const int rings = sides / 2 - 1;
  for (int ring = 0; ring < rings; ++ring) {
    const double latitude = geodesy::kPi * (ring + 1) / (rings + 1) - geodesy::kPi / 2;
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * geodesy::kPi * i / sides;
      set.vertices.emplace_back(radius * std::cos(latitude) * std::cos(angle),
                                radius * std::cos(latitude) * std::sin(angle), radius * std::sin(latitude));
    }
  }
  const auto at = [sides](int ring, int i) {
    return static_cast<std::uint32_t>(2 + ring * sides + i % sides);
  };
  for (int i = 0; i < sides; ++i) {
    set.triangles.push_back({0, at(0, i + 1), at(0, i)});
    set.triangles.push_back({1, at(rings - 1, i), at(rings - 1, i + 1)});
    for (int ring = 0; ring + 1 < rings; ++ring) {
      set.triangles.push_back({at(ring, i), at(ring, i + 1), at(ring + 1, i + 1)});
      set.triangles.push_back({at(ring, i), at(ring + 1, i + 1), at(ring + 1, i)});
    }
  }
  return set;
}

TriangleSet plane_mesh(const Eigen::Vector3d& normal, const Eigen::Vector2d& size) {
  const Eigen::Matrix3d turn =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal).toRotationMatrix();
  TriangleSet set;
  for (const auto& [x, y] : {std::pair{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}) {
    set.vertices.emplace_back(turn * Eigen::Vector3d(x * size.x(), y * size.y(), 0));
  }
  set.triangles = {{0, 1, 2}, {0, 2, 3}};
  return set;
}

}  // namespace canyon::city
