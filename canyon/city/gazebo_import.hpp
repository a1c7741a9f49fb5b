#pragma once

#include <filesystem>

#include "canyon/city/fwd.hpp"

namespace canyon::city {

/// Reads a world or model (.world, .sdf, or a model's folder): models, also nested and included from the
/// file's folder (relative paths, model:// and file://), links and their poses; of each link the collisions,
/// or the visuals if it has no collisions: box, cylinder, sphere (32 sides, inscribed: 0.5 % of the radius),
/// plane (of its size), mesh with scale. Only static models of a world are read, because a city is static; a
/// note names the others, which can move. spherical_coordinates give the origin and a heading that rotates
/// the city to ENU; without them the origin is latitude 0, longitude 0, height 0, with a note. Objects are
/// named MODEL::LINK::GEOMETRY; their surfaces follow from these names as in read_mesh_city(). Meshes written
/// by Canyon keep their own objects, surfaces and materials. The ground plane of write_gazebo_world(), a sun
/// or ground plane from Gazebo's own collection, and geometries of other kinds are omitted with a note.
/// Throws InputError with the line for malformed XML, invalid values, poses relative to frames, missing
/// models and meshes, or no triangle at all.
[[nodiscard]] City read_gazebo_world(const std::filesystem::path& path);

}  // namespace canyon::city
