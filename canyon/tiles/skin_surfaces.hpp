#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/tiles/tile_mesh.hpp"

namespace canyon::tiles {

/// Counts and areas of a skin, before and after it was split and simplified.
struct SkinReport {
  std::size_t triangles = 0, triangles_left = 0;
  std::size_t buildings = 0;  ///< objects
  double terrain_m2 = 0, building_m2 = 0, foliage_m2 = 0;
  [[nodiscard]] std::vector<std::string> lines(double flatten_m) const;
};

/// Splits a skin into terrain, buildings and foliage, makes it of fewer and flat facets, and appends it to a
/// mesh.
///
/// Terrain is what lies less than 2 m above the ground (GroundModel). Above it, planar regions of at least 3
/// m^2 are buildings, as are walls that reach down to the ground; what is rough over 10 m^2 and more is
/// foliage, unless large planes enclose it, or its colours are known and not green. Smaller rough pieces go
/// with what they adjoin: chimneys, dormers, parapets. Small planes amid foliage, and what has foliage and no
/// roof, are foliage: sides of crowns and hedges. @param flatten_m see TileOptions; 0: the triangles stay as
/// they are
[[nodiscard]] SkinReport append_skin(const Skin& skin, double flatten_m, city::Mesh& mesh);

}  // namespace canyon::tiles
