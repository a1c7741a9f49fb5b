#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "canyon/buildings/shapes/footprint.hpp"

namespace canyon::buildings {

/// The second way of triangulate(), for polygons whose GEOS triangulation does not cover them exactly: ear
/// clipping with exact turns, holes bridged. Same contract; time grows with the square of the corners. Empty
/// where the rings cross.
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> triangulate_by_ears(const Polygon2& polygon);

}  // namespace canyon::buildings
