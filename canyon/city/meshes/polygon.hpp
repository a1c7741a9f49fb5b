#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace canyon::meshes {

using Point2 = Eigen::Vector2d;  ///< [m]
using TriangleList = std::vector<std::array<std::uint32_t, 3>>;

/// A simple polygon: outer ring counter-clockwise, holes clockwise, no repeated last point, rings not
/// touching themselves or each other along edges.
struct Polygon2 {
  std::vector<Point2> outer;
  std::vector<std::vector<Point2>> holes;
};
/// Twice the signed area of a ring, positive if counter-clockwise; computed about its first point, so that
/// distant coordinates do not lose digits.
[[nodiscard]] double twice_area(const std::vector<Point2>& ring);

/// Constrained triangulation: indices into outer followed by the holes in order; counter-clockwise; covers
/// the polygon exactly, adds no points, uses every edge of the rings (checked). If rings touch at a point,
/// the first of its indices is used for all. Empty for rings that cross.
[[nodiscard]] TriangleList triangulate(const Polygon2& polygon);

/// Adds the triangles of a face of three or more corners, which may be concave and need not be flat: a fan if
/// it covers the face, else triangulate() on the plane of its mean normal. Corners index `vertices`.
/// @return false for a face that crosses itself, which becomes a fan from its first corner
bool add_face(const std::vector<Eigen::Vector3d>& vertices, const std::vector<std::uint32_t>& corners,
              TriangleList& triangles);

}  // namespace canyon::meshes
