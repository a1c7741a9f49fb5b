#pragma once

#include <vector>

#include "canyon/buildings/shapes/footprint.hpp"

namespace canyon::buildings {

/// The band of a line, `half_width_m` to each side, cut off straight at its ends; corners are mitred. Empty
/// for a line without length. @param half_width_m above 0
[[nodiscard]] std::vector<Polygon2> ribbon(const std::vector<Point2>& line, double half_width_m);

}  // namespace canyon::buildings
