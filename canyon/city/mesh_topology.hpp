#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "canyon/city/city.hpp"

namespace canyon::city {

/// Triangles as vertex indices. The functions below find how they are connected.
using TriangleIndices = std::vector<std::array<std::uint32_t, 3>>;

/// Area below 1e-8 m^2, or not a number: nothing that a ray can hit. Vertices in metres.
[[nodiscard]] bool is_degenerate(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                 const Eigen::Vector3d& c);

/// append_object() with a material for each triangle.
std::size_t append_object(Mesh& mesh, std::string name, Surface surface,
                          const std::vector<Material>& materials,
                          const std::vector<Eigen::Vector3d>& vertices, const TriangleIndices& triangles);

/// Gives vertices of exactly equal position one index (the first one's), in `triangles`; vertices stay.
void weld(const std::vector<Eigen::Vector3d>& vertices, TriangleIndices& triangles);

/// One side of a triangle, lower vertex first.
struct TriangleSide {
  std::uint64_t edge = 0;
  std::uint32_t triangle = 0;
  std::uint32_t corner = 0;  ///< at which it begins
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
/// The triangle across each edge: [t][k] lies across the edge from corner k to k + 1 of t; kNoTriangle where
/// none or several do.
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> neighbours(const TriangleIndices& triangles);

/// Triangles that share vertices, directly or through others, by index: each component's numbers ascend,
/// components are in order of their first triangle. Every index must be below `vertex_count`.
[[nodiscard]] std::vector<std::vector<std::uint32_t>> connected_components(const TriangleIndices& triangles,
                                                                           std::size_t vertex_count);

/// Findings and changes of orient_outwards() in one connected component.
struct OrientedSolids {
  bool closed = false;     ///< no boundary but in the horizontal plane of its lowest vertex (a missing floor)
  bool manifold = true;    ///< no edge has more than two triangles
  bool orientable = true;  ///< its two sides are distinct; parts where they are not are left unchanged
  std::size_t turned = 0;  ///< triangles turned
  double volume_m3 = 0;    ///< enclosed, after turning; meaningful when closed
};

/// Turns triangles of one welded, connected component so that front sides (counter-clockwise) look outwards.
/// Patches are triangles joined by edges of two; in each the minority is turned to agree with the rest, then
/// the whole patch where it encloses a negative volume. An extrusion without a floor counts as enclosing: its
/// boundary lies in the horizontal plane of the component's lowest vertex, within 1 mm. Patches that enclose
/// nothing keep the majority's orientation. z is up; metres.
OrientedSolids orient_outwards(const std::vector<Eigen::Vector3d>& vertices, TriangleIndices& triangles);

/// Turns a connected sheet over whose front looks down; false where it does not.
bool face_up(const std::vector<Eigen::Vector3d>& vertices, TriangleIndices& triangles);

/// As long as twice the area of the triangle, towards its front.
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

/// The area of a box from above; 0 for an empty one.
[[nodiscard]] inline double plan_area(const Box& box) {
  return std::max(0.0, box.max.x() - box.min.x()) * std::max(0.0, box.max.y() - box.min.y());
}

/// Twice the signed area of the triangle that two sides span, positive where v is to the left of u.
[[nodiscard]] inline double cross(const Eigen::Vector2d& u, const Eigen::Vector2d& v) {
  return u.x() * v.y() - u.y() * v.x();
}

}  // namespace canyon::city
