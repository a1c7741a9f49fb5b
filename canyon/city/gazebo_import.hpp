#pragma once

#include <filesystem>

#include "canyon/city/fwd.hpp"

namespace canyon::city {

/// Reads a world or model (.world, .sdf, or a model's folder): models, also nested and included from beside
/// the file (relative paths, model:// and file://), links and their poses; of each link the collisions, or
/// the visuals where it has none: box, cylinder, sphere (32 sides, inscribed: 0.5 % of the radius), plane
/// (of its size), mesh with scale. Only static models of a world are read, as a city is: the others can move,
/// and a note names them. spherical_coordinates become the origin and a heading turns the city to ENU;
/// without them the origin is latitude 0, longitude 0, height 0, and a note says so. Objects are named
/// MODEL::LINK::GEOMETRY, surfaces follow from these names as in read_mesh_city(); meshes that Canyon wrote
/// keep their own objects, surfaces and materials. The ground plane of write_gazebo_world(), a sun or ground
/// plane from Gazebo's own collection, and geometries of other kinds are left out with a note. Throws
/// InputError with the line for malformed XML, values that make no sense, poses relative to frames, models
/// and meshes that are not there, or no triangle at all.
[[nodiscard]] City read_gazebo_world(const std::filesystem::path& path);

}  // namespace canyon::city
