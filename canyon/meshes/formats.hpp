#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "canyon/meshes/mesh_scene.hpp"

// The readers of read_mesh_scene(), one for each format.

namespace canyon::meshes {

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
