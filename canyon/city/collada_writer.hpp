#pragma once

#include <string>
#include <vector>

#include "canyon/base/output_file.hpp"
#include "canyon/city/mesh_parts.hpp"

namespace canyon::city {

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
