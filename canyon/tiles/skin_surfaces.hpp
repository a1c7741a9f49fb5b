#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/tiles/tile_mesh.hpp"

namespace canyon::tiles {

/// Splits a skin into terrain, buildings and foliage, makes it of fewer and flat facets, and appends it to a
/// mesh. Returns notes.
///
/// Terrain is what lies less than 2 m above the ground (GroundModel). Above it, planar regions of at least 3
/// m^2 are buildings, as are walls that reach down to the ground; what is rough over 10 m^2 and more is
/// foliage, unless large planes enclose it. Smaller rough pieces go with what they adjoin: chimneys, dormers,
/// parapets. Small planes amid foliage, and what has foliage and no roof, are foliage: sides of crowns and
/// hedges.
[[nodiscard]] std::vector<std::string> append_skin(const Skin& skin, city::Mesh& mesh);

}  // namespace canyon::tiles
