#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "canyon/base/output_file.hpp"
#include "canyon/city/city.hpp"

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

/// Writes glTF 2.0 binary (Khronos glTF 2.0, section 4.4), Y up as the standard asks (x east, y up, z south):
/// a node for each object about a whole metre near its own middle, so that single precision holds 1 mm and
/// better there. Origin and name stand in the asset's extras. Throws InputError for a city of 4 GiB and more.
/// Does not commit.
void write_glb(OutputFile& file, const City& city);

/// One node of a COLLADA scene.
struct ColladaNode {
  std::string name;  ///< an NCName, see NameCharacters::XmlName
  std::vector<Object> objects;
};

/// Writes COLLADA 1.4.1, Z up, metres: a geometry and a node for each of `nodes`, flat normals, a material
/// named by material_name() for each that occurs. Coordinates are less `origin`. `title` and `comment` stand
/// in the asset; `marked` puts kMeshMark there as well. The same city gives the same bytes. Does not commit.
void write_collada(OutputFile& file, const Mesh& mesh, const std::vector<ColladaNode>& nodes,
                   const std::string& title, const std::string& comment, bool marked,
                   const Eigen::Vector3d& origin = Eigen::Vector3d::Zero());

}  // namespace canyon::city
