#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace canyon::buildings {

using Point2 = Eigen::Vector2d;  ///< [m], east and north in the city's frame

/// A simple polygon: outer ring counter-clockwise, holes clockwise, no repeated last point, rings not
/// touching themselves or each other along edges.
struct Polygon2 {
  std::vector<Point2> outer;
  std::vector<std::vector<Point2>> holes;
};
/// Twice the signed area of a ring, positive when counter-clockwise; taken about its first point, so that far
/// coordinates cost no digits.
[[nodiscard]] double twice_area(const std::vector<Point2>& ring);
[[nodiscard]] double perimeter(const std::vector<Point2>& ring);  ///< [m]
[[nodiscard]] double area(const Polygon2& polygon);               ///< [m^2], holes taken out

/// Makes valid polygons of rings as maps have them, with GEOS: orientation, repeated points, spikes,
/// self-crossings, holes that touch or cross the outer ring, overlapping outers. Points closer than 1 mm
/// become one (so that what leaves here stays distinct as floats), slivers below 0.01 m^2 vanish. An empty
/// result means that nothing certain was left; `notes` gets what was repaired ("self-crossing outline") or
/// why it is empty.
[[nodiscard]] std::vector<Polygon2> repair(const std::vector<Polygon2>& raw, std::vector<std::string>& notes);

/// a without b, a and b, or all of a: on the grid and clean as from repair(). Polygons must come from
/// repair(). Subtract and intersect leave out pieces narrower than 2 cm on average (twice the area over the
/// perimeter): seams between outlines that were meant to share an edge.
[[nodiscard]] std::vector<Polygon2> subtract(const std::vector<Polygon2>& a, const std::vector<Polygon2>& b);
[[nodiscard]] std::vector<Polygon2> intersect(const std::vector<Polygon2>& a, const std::vector<Polygon2>& b);
[[nodiscard]] std::vector<Polygon2> unite(const std::vector<Polygon2>& a);

/// Constrained triangulation: indices into outer followed by the holes in order; counter-clockwise; covers
/// the polygon exactly, adds no points, uses every edge of the rings (checked). Where rings touch at a point,
/// the first of its indices stands for all. Empty for rings that cross.
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> triangulate(const Polygon2& polygon);

}  // namespace canyon::buildings
