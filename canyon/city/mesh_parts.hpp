#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/city/mesh_topology.hpp"

namespace canyon::city {

/// Triangles of one material, in their order, as indices into MeshPart::vertices.
struct MaterialGroup {
  Material material = Material::Unknown;
  TriangleIndices triangles;
};

/// One node of a mesh file: some triangles with the vertices that they use.
struct MeshPart {
  std::vector<Eigen::Vector3d> vertices;  ///< [m], about the origin given
  std::vector<MaterialGroup> groups;      ///< in the order of first use, none empty
};

/// The triangles of an object, with vertices relative to `origin`.
[[nodiscard]] MeshPart mesh_part(const Mesh& mesh, const Object& object,
                                 const Eigen::Vector3d& origin = Eigen::Vector3d::Zero());

/// The triangles of several objects in one part.
[[nodiscard]] MeshPart mesh_part(const Mesh& mesh, const std::vector<Object>& objects,
                                 const Eigen::Vector3d& origin = Eigen::Vector3d::Zero());

/// Objects that have triangles.
[[nodiscard]] std::vector<Object> objects_with_triangles(const Mesh& mesh);

/// Materials in use, ascending.
[[nodiscard]] std::vector<Material> materials_of(const Mesh& mesh);

/// Appends metres to a micrometre, without trailing zeros; never "-0".
void append_metres(fmt::memory_buffer& out, double metres);

}  // namespace canyon::city
