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
  std::string above;                      ///< names of the nodes above it, with '/' between them
  std::vector<Eigen::Vector3d> vertices;  ///< in the file's unit and axes, after the nodes' transforms
  std::vector<SceneFaces> faces;          ///< counter-clockwise triangles seen from their front
};

/// What is read of a mesh file: nodes with triangles. Lines, points, pictures, lights and animations are not
/// read.
struct MeshScene {
  double metres_per_unit = 1;
  char up = 'Z';  ///< 'X', 'Y' or 'Z'
  std::vector<SceneNode> nodes;
  ReadReport notes;  ///< what was left out, by name and number; without the path
};

/// The largest file of a mesh, or that a mesh names [bytes].
inline constexpr std::uint64_t kLargestMesh = std::uint64_t{2} << 30;
/// A file with more triangles is refused.
inline constexpr std::size_t kMostTriangles = 30'000'000;
/// Names of nodes and materials are cut here: many may share one.
inline constexpr std::size_t kLongestName = 1000;

/// Reads a file by its ending. Vertices are doubles as the file has them; faces with notches are cut into
/// triangles that cover them. Every index refers to a vertex of its node. Throws InputError for a file that
/// is cut short, for numbers that are none or do not agree, for references to what is not there, and for
/// another ending.
///  - .dae: COLLADA 1.4 and 1.5. Geometries of triangles, polylist, polygons, trifans and tristrips; nodes
///    with matrix, translate, rotate and scale; instances of geometries, controllers (the mesh as modelled)
///    and nodes. `lookat` and `skew` are refused.
///  - .gltf, .glb: read_gltf(), with buffers beside the file or in it
///  - .obj: v, f, o, g and usemtl
///  - .stl: binary, or the words of the ASCII form in capitals or not
///  - .ply: x, y and z of vertices, and faces; ASCII or binary; strips are refused
/// @param own_names nodes of COLLADA are called by their names, which other programs may repeat, not by their
///   ids
[[nodiscard]] MeshScene read_mesh_scene(const std::filesystem::path& path, bool own_names = false);

// The readers of read_mesh_scene(), one for each format.
inline constexpr std::string_view kDamagedMesh = "export or copy it again: it is damaged";

[[nodiscard]] MeshScene read_collada(const std::filesystem::path& path, bool own_names);
[[nodiscard]] MeshScene read_gltf_file(const std::filesystem::path& path);
[[nodiscard]] MeshScene read_obj(const std::filesystem::path& path);
[[nodiscard]] MeshScene read_ply(const std::filesystem::path& path);
[[nodiscard]] MeshScene read_stl(const std::filesystem::path& path);

/// All bytes of a file of a mesh. Throws InputError where it cannot be read, for pipes and devices, and above
/// kLargestMesh.
[[nodiscard]] std::string mesh_bytes(const std::filesystem::path& path);

/// "3 faces cross themselves ..."; no line for none.
void note_crossed(std::size_t faces, ReadReport& notes);

/// Makes a node of faces whose corners are indices of a table of the file. The node gets the vertices that
/// they use, in the order of their first use.
class NodeBuilder {
 public:
  /// Faces that follow are of this table, which may grow, with a transform; a mirroring one turns them.
  void use(const std::vector<Eigen::Vector3d>& table, const Eigen::Affine3d& transform);
  /// Faces that follow are of this material.
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
