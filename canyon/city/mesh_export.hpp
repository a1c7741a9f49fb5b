#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "canyon/base/output_file.hpp"
#include "canyon/city/city.hpp"

namespace canyon::city {

/// Writes glTF 2.0 binary (.glb), Wavefront OBJ (.obj with a .mtl file) or COLLADA 1.4.1 (.dae): one node for
/// each object by its name, one material for each city::Material by its name and with a colour, so that
/// read_mesh_city() restores the same triangles, objects, surfaces and materials, corners within 1 mm up to 8
/// km from the middle of an object (.glb has single precision about the middle of each node; the others have
/// micrometres). OBJ and COLLADA have micrometres, Z up; glTF is Y up as required by its standard. The origin
/// is in glTF's asset extras and in comments of the others; the reader of the file gives it again
/// (MeshImportOptions::origin). mesh_marks.hpp describes the encoding of names and surfaces. Objects without
/// triangles are omitted. The same city gives the same bytes. Written completely or not at all. Part of
/// canyon::io. Throws InputError for another extension, a city without a triangle, or a failed write.
void write_mesh(const std::filesystem::path& path, const City& city);

/// Writes glTF 2.0 binary (Khronos glTF 2.0, section 4.4), Y up as the standard requires (x east, y up, z
/// south): a node for each object, with its origin at whole metres near its middle, so that single precision
/// keeps 1 mm or better. Origin and name are in the asset's extras. Throws InputError for a city of 4 GiB or
/// more. Does not commit.
void write_glb(OutputFile& file, const City& city);

/// One node of a COLLADA scene.
struct ColladaNode {
  std::string name;  ///< an NCName, see NameCharacters::XmlName
  std::vector<Object> objects;
};

/// Writes COLLADA 1.4.1, Z up, metres: a geometry and a node for each of `nodes`, flat normals, a material
/// named by material_name() for each one used. `origin` is subtracted from the coordinates. `title` and
/// `comment` go into the asset; `marked` adds kMeshMark. The same city gives the same bytes. Does not commit.
void write_collada(OutputFile& file, const Mesh& mesh, const std::vector<ColladaNode>& nodes,
                   const std::string& title, const std::string& comment, bool marked,
                   const Eigen::Vector3d& origin = Eigen::Vector3d::Zero());

}  // namespace canyon::city
