#pragma once

#include <string>
#include <vector>

#include "canyon/meshes/polygon.hpp"

namespace canyon::buildings {

using meshes::Point2;  ///< [m], east and north in the city's frame
using meshes::Polygon2;
using meshes::triangulate;
using meshes::twice_area;

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

/// The band of a line, `half_width_m` to each side, cut off straight at its ends; corners are mitred. Empty
/// for a line without length. @param half_width_m above 0
[[nodiscard]] std::vector<Polygon2> ribbon(const std::vector<Point2>& line, double half_width_m);

}  // namespace canyon::buildings
