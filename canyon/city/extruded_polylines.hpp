#pragma once

#include <optional>
#include <string>
#include <vector>

#include "canyon/city/link_shapes.hpp"

namespace canyon::city {

/// SDF's polylines extruded from 0 to `height` [m], an Extrude for those who have no simulator: a closed
/// surface about what an odd number of the closed paths surrounds, so that a path within another is its hole.
/// Empty where the paths surround nothing.
[[nodiscard]] std::optional<MeshNode> extruded_polylines(const std::string& name,
                                                         const std::vector<Polyline>& polylines,
                                                         double height);

}  // namespace canyon::city
