#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "canyon/city/city.hpp"

namespace canyon::city {

/// Triangles as vertex indices. The functions below determine their connections.
using TriangleIndices = std::vector<std::array<std::uint32_t, 3>>;

/// Area below 1e-8 m^2, or not a number: too small for a ray to hit. Vertices in metres.
[[nodiscard]] bool is_degenerate(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                 const Eigen::Vector3d& c);

/// append_object() with a material for each triangle.
std::size_t append_object(Mesh& mesh, std::string name, Surface surface,
                          const std::vector<Material>& materials,
                          const std::vector<Eigen::Vector3d>& vertices, const TriangleIndices& triangles);

/// In `triangles`, gives vertices of exactly equal position one index (the first one's); `vertices` stay.
void weld(const std::vector<Eigen::Vector3d>& vertices, TriangleIndices& triangles);

/// One side of a triangle, lower vertex first.
struct TriangleSide {
  std::uint64_t edge = 0;
  std::uint32_t triangle = 0;
  std::uint32_t corner = 0;  ///< start corner
  bool forward = true;       ///< the triangle runs from the lower to the higher vertex
};

/// All sides, by edge and triangle. Vertices below 2^32.
[[nodiscard]] std::vector<TriangleSide> sorted_sides(const TriangleIndices& triangles);
/// Calls edge(sides) for the sides at each edge, edges ascending.
template <typename Edge>
void each_edge(const TriangleIndices& triangles, const Edge& edge) {
  const std::vector<TriangleSide> sides = sorted_sides(triangles);
  for (auto begin = sides.begin(); begin != sides.end();) {
    const auto end =
        std::find_if(begin, sides.end(), [&](const TriangleSide& s) { return s.edge != begin->edge; });
    edge(std::span<const TriangleSide>(&*begin, static_cast<std::size_t>(end - begin)));
    begin = end;
  }
}

inline constexpr std::uint32_t kNoTriangle = 0xFFFFFFFF;
/// The neighbour across each edge: [t][k] is across the edge from corner k to k + 1 of t; kNoTriangle if
/// there are none or several.
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> neighbours(const TriangleIndices& triangles);

/// Triangles that share vertices, directly or through others, by index: indices ascend in each component,
/// components are in the order of their first triangle. Every index must be below `vertex_count`.
[[nodiscard]] std::vector<std::vector<std::uint32_t>> connected_components(const TriangleIndices& triangles,
                                                                           std::size_t vertex_count);

/// Results of orient_outwards() for one connected component.
struct OrientedSolids {
  bool closed = false;  ///< no boundary except in the horizontal plane of its lowest vertex (a missing floor)
  bool manifold = true;           ///< no edge has more than two triangles
  bool orientable = true;         ///< its two sides are distinct; parts for which they are not are unchanged
  std::size_t flipped_count = 0;  ///< flipped triangles
  double volume_m3 = 0;           ///< enclosed, after flipping; valid if closed
};

/// Flips triangles of one welded, connected component so that front sides (counter-clockwise) face outwards.
/// Patches are triangles joined by edges of two; in each the minority is flipped to agree with the rest, then
/// the whole patch if it encloses a negative volume. An extrusion without a floor counts as enclosing: its
/// boundary is in the horizontal plane of the component's lowest vertex, within 1 mm. Patches that enclose
/// nothing keep the majority's orientation. z is up; metres.
OrientedSolids orient_outwards(const std::vector<Eigen::Vector3d>& vertices, TriangleIndices& triangles);

/// Flips a connected sheet whose front faces down; false if it cannot be decided.
bool face_up(const std::vector<Eigen::Vector3d>& vertices, TriangleIndices& triangles);

/// Length: twice the area of the triangle; direction: towards its front.
[[nodiscard]] inline Eigen::Vector3d normal_of(const std::vector<Eigen::Vector3d>& vertices,
                                               const std::array<std::uint32_t, 3>& triangle) {
  const auto& [a, b, c] = triangle;
  return (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]);
}

inline void extend(Box& box, const Eigen::Vector3d& point) {
  box.min = box.min.cwiseMin(point);
  box.max = box.max.cwiseMax(point);
}

/// Extends a box by an object of a mesh.
inline void extend(Box& box, const Mesh& mesh, const Object& object) {
  for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t)
    for (const std::uint32_t v : mesh.triangles[t]) extend(box, mesh.vertices[v]);
}

[[nodiscard]] inline Eigen::Vector3d middle_of(const Box& box) {
  return 0.5 * (box.min + box.max);
}

/// The area of a box in plan; 0 for an empty one.
[[nodiscard]] inline double plan_area(const Box& box) {
  return std::max(0.0, box.max.x() - box.min.x()) * std::max(0.0, box.max.y() - box.min.y());
}

/// Twice the signed area of the triangle that two sides span, positive if v is to the left of u.
[[nodiscard]] inline double cross(const Eigen::Vector2d& u, const Eigen::Vector2d& v) {
  return u.x() * v.y() - u.y() * v.x();
}

}  // namespace canyon::city
