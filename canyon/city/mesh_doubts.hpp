#pragma once

#include <string>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/city/mesh_file_format.hpp"

struct aiScene;

// Signs of damage, or of a wrong reading, in what was read without an error.

namespace canyon::city {

/// Adds a line each for polygons of more than three corners that are not flat and for faces whose corners
/// disagree with the normals that the file states of them, where most are flat and agree: a vertex has moved.
/// The scene is as the file has it, before any of Assimp's steps.
void add_face_doubts(const aiScene& scene, std::vector<std::string>& doubts);

/// A line each for objects (terrain apart) that lie far from all others, are much wider than they, or are
/// higher than any building.
[[nodiscard]] std::vector<std::string> implausible_objects(const Mesh& mesh);

/// A warning where a mesh of another program (no `up_axis` given) seems to lie on its side, by its format
/// (OBJ, STL, PLY: z up; glTF: y) or by its own word (COLLADA): its terrain stands upright, or at least three
/// quarters of three or more buildings start at one plane to the north or south and few on one level. Empty
/// otherwise.
/// @param heading_rad by which the mesh was turned
[[nodiscard]] std::string up_axis_caution(const City& city, UpAxis up, const std::filesystem::path& path,
                                          double heading_rad);

}  // namespace canyon::city
