#include "canyon/city/meshes/mesh_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <utility>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/input_files.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/meshes/gltf_buffers.hpp"
#include "canyon/city/meshes/gltf_model.hpp"

namespace canyon::meshes {

std::string mesh_bytes(const std::filesystem::path& path) {
  check_input_file(path, kMaxMesh);
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  std::string bytes(in ? static_cast<std::size_t>(in.tellg()) : 0, '\0');
  if (!in.seekg(0) || !in.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
    throw InputError(path, 0, "cannot be read");
  return bytes;
}

void note_crossed(std::size_t faces, ReadReport& notes) {
  if (faces == 0) return;
  notes.add_counted(ReadReport::Level::Guess,
                    "{} faces cross themselves; each is read as a fan from its first corner", {}, faces);
}

void NodeBuilder::use(const std::vector<Eigen::Vector3d>& table, const Eigen::Affine3d& transform) {
  table_ = &table;
  transform_ = transform;
  mirrored_ = transform.linear().determinant() < 0;
  index_of_.clear();
}

void NodeBuilder::use_material(const std::string& name) {
  const std::string cut = name.substr(0, kMaxName);
  if (node.faces.empty() || node.faces.back().material != cut) node.faces.push_back({cut, {}});
}

void NodeBuilder::add(const std::vector<std::uint32_t>& corners) {
  own_.clear();
  for (const std::uint32_t corner : corners) {
    const auto next = static_cast<std::uint32_t>(node.vertices.size());
    const auto [found, fresh] = index_of_.try_emplace(corner, next);
    if (fresh) node.vertices.emplace_back(transform_ * (*table_)[corner]);
    own_.push_back(found->second);
  }
  TriangleList& all = node.faces.back().triangles;
  const std::size_t first = all.size();
  if (!add_face(node.vertices, own_, all)) ++crossed;
  triangles += all.size() - first;
  for (std::size_t t = first; mirrored_ && t < all.size(); ++t) std::swap(all[t][1], all[t][2]);
}

MeshScene read_gltf_file(const std::filesystem::path& path) {
  const FetchBytes fetch = [&path](const std::string& uri) {
    return mesh_bytes(file_named_by(path, percent_decoded(uri)));
  };
  GltfModel model;
  try {
    model = read_gltf(mesh_bytes(path), fetch);
  } catch (const InputError& error) {
    if (!error.file().empty()) throw;
    throw InputError(path, 0, error.problem(), error.hint());
  } catch (const JsonError& error) {
    throw InputError(path, 0, fmt::format("is not valid glTF 2.0 ({})", error.what()), kDamagedMesh);
  }
  MeshScene scene;
  scene.up = 'Y';
  std::optional<std::uint64_t> node;
  for (GltfPrimitive& primitive : model.primitives) {
    if (node != primitive.node_index) scene.nodes.push_back({primitive.node, primitive.above, {}, {}});
    node = primitive.node_index;
    SceneNode& to = scene.nodes.back();
    const auto shift = static_cast<std::uint32_t>(to.vertices.size());
    to.vertices.insert(to.vertices.end(), primitive.positions.begin(), primitive.positions.end());
    for (auto& triangle : primitive.triangles)
      for (std::uint32_t& v : triangle) v += shift;
    to.faces.push_back({std::move(primitive.material), std::move(primitive.triangles)});
  }
  const auto report = [&scene](ReadReport::Level level, std::string_view what, std::size_t count) {
    if (count > 0) scene.notes.add_counted(level, what, {}, count);
  };
  report(ReadReport::Level::Remark, "{} primitives of lines or points left out", model.lines_and_points);
  report(ReadReport::Level::Loss, "{} meshes are not in the scene and left out", model.meshes_outside);
  report(ReadReport::Level::Guess, "{} nodes are hidden by KHR_node_visibility, and are built", model.hidden);
  if (model.no_scene)
    scene.notes.add_line(ReadReport::Level::Guess, "it has no scene; all its nodes are read as one");
  if (model.centre)
    scene.notes.add_line(ReadReport::Level::Guess,
                         "its position on the Earth (CESIUM_RTC) is not read: the city is at city.origin");
  return scene;
}

MeshScene read_mesh_scene(const std::filesystem::path& path, bool object_names) {
  const std::string extension = lower_case(path.extension().string());
  if (extension == ".dae") return read_collada(path, object_names);
  if (extension == ".obj") return read_obj(path);
  if (extension == ".stl") return read_stl(path);
  if (extension == ".ply") return read_ply(path);
  if (extension == ".gltf" || extension == ".glb") return read_gltf_file(path);
  throw InputError(path, 0, fmt::format("unknown mesh format '{}'", extension),
                   "use .dae, .obj, .stl, .gltf, .glb or .ply");
}

}  // namespace canyon::meshes
