#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <utility>
#include <vector>

#include "canyon/city/city.hpp"

namespace canyon::test {

/// Volume [m^3] enclosed by an object's triangles (divergence theorem), and whether it is watertight:
/// directed edges pair off with opposite ones, vertices compared by position. (Four walls may meet in one
/// edge, if a courtyard touches the outline.) Not watertight without triangles.
struct SolidCheck {
  double volume_m3 = 0;
  bool watertight = false;
};
[[nodiscard]] inline SolidCheck check_solid(const city::Mesh& mesh, const city::Object& object) {
  assert(object.first_triangle + object.triangle_count <= mesh.triangles.size());
  SolidCheck check;
  if (object.triangle_count == 0) return check;
  using Position = std::array<double, 3>;
  std::vector<std::array<Position, 3>> triangles;
  std::vector<Position> positions;
  triangles.reserve(object.triangle_count);
  positions.reserve(3 * static_cast<std::size_t>(object.triangle_count));
  // Relative to a vertex of the object, to keep precision far from the origin.
  const Eigen::Vector3d origin = mesh.vertices[mesh.triangles[object.first_triangle][0]];
  for (std::uint32_t t = 0; t < object.triangle_count; ++t) {
    const auto& corners = mesh.triangles[object.first_triangle + t];
    std::array<Position, 3> triangle{};
    std::array<Eigen::Vector3d, 3> from_origin;
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d& v = mesh.vertices[corners[k]];
      from_origin[k] = v - origin;
      triangle[k] = {v.x(), v.y(), v.z()};
      positions.push_back(triangle[k]);
    }
    check.volume_m3 += from_origin[0].dot(from_origin[1].cross(from_origin[2])) / 6;
    triangles.push_back(triangle);
  }
  std::sort(positions.begin(), positions.end());
  positions.erase(std::unique(positions.begin(), positions.end()), positions.end());
  const auto index = [&](const Position& p) {
    return static_cast<std::uint32_t>(std::lower_bound(positions.begin(), positions.end(), p) -
                                      positions.begin());
  };
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  std::vector<Edge> edges, opposites;
  for (const auto& triangle : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = index(triangle[k]), b = index(triangle[(k + 1) % 3]);
      edges.emplace_back(a, b);
      opposites.emplace_back(b, a);
    }
  }
  std::sort(edges.begin(), edges.end());
  std::sort(opposites.begin(), opposites.end());
  check.watertight = edges == opposites;
  return check;
}

}  // namespace canyon::test
