#pragma once

#include <filesystem>

#include "canyon/city/city.hpp"

namespace canyon::city {

/// Writes glTF 2.0 binary (.glb), Wavefront OBJ (.obj with .mtl) or Collada (.dae) through Assimp: one node
/// for each object by its name ("terrain..." for terrain), one material for each city::Material by its name,
/// so that read_mesh_city() finds the same triangles, objects, surfaces and materials again. glTF is Y-up as
/// its standard asks, the others Z-up. Whole or not at all. Part of canyon::io. Throws InputError for another
/// ending or where nothing can be written.
void write_mesh(const std::filesystem::path& path, const City& city);

}  // namespace canyon::city
