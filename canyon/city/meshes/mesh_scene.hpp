#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "canyon/base/read_report.hpp"
#include "canyon/city/meshes/polygon.hpp"

namespace canyon::meshes {

/// Triangles of one material, as indices into SceneNode::vertices.
struct SceneFaces {
  std::string material;  ///< its name; may be empty
  TriangleList triangles;
};

/// A node of a mesh file that has triangles.
struct SceneNode {
  std::string name;                       ///< may be empty
  std::string above;                      ///< names of the parent nodes, with '/' between them
  std::vector<Eigen::Vector3d> vertices;  ///< in the file's unit and axes, after the nodes' transforms
  std::vector<SceneFaces> faces;          ///< counter-clockwise triangles seen from their front
};

/// The contents of a mesh file that are read: nodes with triangles. Lines, points, textures, lights and
/// animations are not read.
struct MeshScene {
  double metres_per_unit = 1;
  char up = 'Z';  ///< 'X', 'Y' or 'Z'
  std::vector<SceneNode> nodes;
  ReadReport notes;  ///< omissions, by name and number; without the path
};

/// Limit of the size of a mesh file, or of a file that it references [bytes].
inline constexpr std::uint64_t kMaxMesh = std::uint64_t{2} << 30;
/// A file with more triangles is rejected.
inline constexpr std::size_t kMaxTriangles = 30'000'000;
/// Names of nodes and materials are cut to this length, because many nodes may have the same long name.
inline constexpr std::size_t kMaxName = 1000;

/// Reads a file by its extension. Vertices are doubles as in the file; concave faces are cut into triangles
/// that cover them. Every index refers to a vertex of its node. Throws InputError for a file that is cut
/// short, for invalid or inconsistent numbers, for unresolved references, and for another extension.
///  - .dae: COLLADA 1.4 and 1.5. Geometries of triangles, polylist, polygons, trifans and tristrips; nodes
///    with matrix, translate, rotate and scale; instances of geometries, controllers (the mesh as modelled)
///    and nodes. `lookat` and `skew` are rejected.
///  - .gltf, .glb: read_gltf(), with buffers next to the file or in it
///  - .obj: v, f, o, g and usemtl
///  - .stl: binary or ASCII, keywords in any case
///  - .ply: x, y and z of vertices, and faces; ASCII or binary; strips are rejected
/// @param object_names nodes of COLLADA get names, which may repeat, instead of ids
[[nodiscard]] MeshScene read_mesh_scene(const std::filesystem::path& path, bool object_names = false);

// The readers of read_mesh_scene(), one for each format.
inline constexpr std::string_view kDamagedMesh = "export or copy it again: it is damaged";

[[nodiscard]] MeshScene read_collada(const std::filesystem::path& path, bool object_names);
[[nodiscard]] MeshScene read_gltf_file(const std::filesystem::path& path);
[[nodiscard]] MeshScene read_obj(const std::filesystem::path& path);
[[nodiscard]] MeshScene read_ply(const std::filesystem::path& path);
[[nodiscard]] MeshScene read_stl(const std::filesystem::path& path);

/// All bytes of a mesh file. Throws InputError if unreadable, no regular file, or above kMaxMesh.
[[nodiscard]] std::string mesh_bytes(const std::filesystem::path& path);

/// "3 faces cross themselves ..."; no line for none.
void note_crossed(std::size_t faces, ReadReport& notes);

/// Builds a node from faces whose corners are indices into a table of the file. The node gets the vertices
/// that they use, in the order of first use.
class NodeBuilder {
 public:
  /// Following faces use this table, which may grow, with a transform; a mirroring transform flips them.
  void use(const std::vector<Eigen::Vector3d>& table, const Eigen::Affine3d& transform);
  /// Following faces have this material.
  void use_material(const std::string& name);
  void add(const std::vector<std::uint32_t>& corners);

  SceneNode node;
  std::size_t triangles = 0, crossed = 0;

 private:
  const std::vector<Eigen::Vector3d>* table_ = nullptr;
  Eigen::Affine3d transform_ = Eigen::Affine3d::Identity();
  bool mirrored_ = false;
  std::unordered_map<std::uint32_t, std::uint32_t> index_of_;
  std::vector<std::uint32_t> own_;
};

}  // namespace canyon::meshes
