#pragma once

#include <string>
#include <vector>

#include "canyon/city/city.hpp"

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

}  // namespace canyon::city
