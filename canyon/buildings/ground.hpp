#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

#include "canyon/buildings/map_frame.hpp"
#include "canyon/buildings/sources/map_data.hpp"
#include "canyon/city/city.hpp"

namespace canyon::buildings {

/// The ground along a feature, in mesh coordinates [m].
struct Ground {
  double lowest_z = 0, mean_z = 0;  ///< over its points
  double lowest_height_m = 0;       ///< ellipsoidal, of the lowest one
};

/// The ground at the corners of the outer rings and, on a terrain, at points at most 10 m apart between them.
/// Empty where the terrain has no height for any of them.
[[nodiscard]] std::optional<Ground> ground_along(const std::vector<MapPolygon>& polygons,
                                                 const MapFrame& map_frame, bool terrain);

/// Appends the object "terrain" over `enu_bounds` (east, north [m] in the frame about the origin): the
/// terrain's sheet, or without one (nullptr) a sheet at the origin's ellipsoidal height with posts 500 m
/// apart. Throws InputError where the terrain does not cover it, or would have more than 25 million posts.
void append_ground(city::Mesh& mesh, const MapFrame& map_frame, const Terrain* terrain,
                   const Eigen::AlignedBox2d& enu_bounds, double terrain_spacing_m);

}  // namespace canyon::buildings
