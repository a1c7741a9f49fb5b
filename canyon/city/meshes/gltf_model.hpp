#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/city/meshes/polygon.hpp"

namespace canyon::meshes {

/// The triangles of one primitive of one node.
struct GltfPrimitive {
  std::uint64_t node_index = 0;
  std::string node;       ///< name of the node, of one above it, or of its mesh; may be empty
  std::string above;      ///< names of the nodes above it, with '/' between them
  std::string material;   ///< name; may be empty
  bool pictured = false;  ///< its colour is a picture, or its vertices have colours
  std::vector<Eigen::Vector3d> positions;  ///< after the nodes' transforms: y up, unless the tileset says z
  TriangleList triangles;
  /// Feature of each position: its row in a batch table, or in property table `table`. Empty: no features.
  std::vector<std::uint32_t> features;
  std::optional<std::uint32_t> table;
};

/// A glTF 2.0 asset as triangles, in double precision. Pictures and animations are not read.
struct GltfModel {
  std::vector<GltfPrimitive> primitives;
  /// Properties of texts, by name, of property tables (EXT_structural_metadata).
  std::map<std::uint32_t, std::map<std::string, std::vector<std::string>>> tables;
  std::optional<Eigen::Vector3d> centre;  ///< CESIUM_RTC
  std::string copyright;                  ///< of the asset: whom to name
  std::size_t lines_and_points = 0;       ///< primitives that are no triangles, left out
  std::size_t meshes_outside = 0;         ///< meshes that no node of the scene has, left out
  bool no_scene = false;                  ///< none says which nodes are shown: all are
  std::size_t hidden = 0;                 ///< nodes that KHR_node_visibility hides; their triangles are there
};

/// Gives the bytes that a URI of the asset names; data: URIs need none. Throws InputError.
using FetchBytes = std::function<std::string(const std::string& uri)>;

/// Decodes glTF 2.0, binary or JSON: accessors of all types, sparse ones, strips and fans,
/// KHR_mesh_quantization, EXT_mesh_gpu_instancing, KHR_draco_mesh_compression and EXT_meshopt_compression
/// (where built with these libraries), EXT_mesh_features and EXT_structural_metadata for names. Throws
/// InputError, which names no file, for anything else that the asset requires, for cut data and for indices
/// beyond what they refer to.
[[nodiscard]] GltfModel read_gltf(std::string_view bytes, const FetchBytes& fetch);

}  // namespace canyon::meshes
