#pragma once

#include <filesystem>

#include "canyon/city/fwd.hpp"

namespace canyon::city {

/// Writes glTF 2.0 binary (.glb), Wavefront OBJ (.obj with .mtl beside it) or COLLADA 1.4.1 (.dae): one node
/// for each object by its name, one material for each city::Material by its name and with a colour, so that
/// read_mesh_city() finds the same triangles, objects, surfaces and materials again, corners within 1 mm up
/// to 8 km from the middle of an object (.glb holds single precision about the middle of each node; the
/// others micrometres). OBJ and COLLADA hold micrometres, Z up; glTF is Y up as its standard asks. The
/// origin stands in glTF's asset extras and in comments of the others; the reader of the file gives it again
/// (MeshImportOptions::origin). How names and surfaces are written: mesh_marks.hpp. Objects without triangles
/// are left out. The same city gives the same bytes. Whole or not at all. Part of canyon::io. Throws
/// InputError for another ending, for a city without a triangle, or where nothing can be written.
void write_mesh(const std::filesystem::path& path, const City& city);

}  // namespace canyon::city
