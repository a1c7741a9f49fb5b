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
  std::string node;                        ///< name of the node, of a parent, or of its mesh; may be empty
  std::string above;                       ///< names of the parent nodes, with '/' between them
  std::string material;                    ///< name; may be empty
  bool pictured = false;                   ///< its colour is a texture, or its vertices have colours
  std::vector<Eigen::Vector3d> positions;  ///< after the nodes' transforms: y up, unless the tileset has z up
  TriangleList triangles;
  /// Feature of each position: its row in a batch table, or in property table `table`. Empty: no features.
  std::vector<std::uint32_t> features;
  std::optional<std::uint32_t> table;
};

/// A glTF 2.0 asset as triangles, in double precision. Textures and animations are not read.
struct GltfModel {
  std::vector<GltfPrimitive> primitives;
  /// Text properties, by name, of property tables (EXT_structural_metadata).
  std::map<std::uint32_t, std::map<std::string, std::vector<std::string>>> tables;
  std::optional<Eigen::Vector3d> centre;  ///< CESIUM_RTC
  std::string copyright;                  ///< of the asset: attribution
  std::size_t lines_and_points = 0;       ///< primitives that are no triangles, omitted
  std::size_t meshes_outside = 0;         ///< meshes that no node of the scene uses, omitted
  bool no_scene = false;                  ///< the asset has no default scene: all nodes are shown
  std::size_t hidden = 0;  ///< nodes hidden by KHR_node_visibility; their triangles are included
};

/// Returns the bytes of a URI of the asset; not called for data: URIs. Throws InputError.
using FetchBytes = std::function<std::string(const std::string& uri)>;

/// Decodes glTF 2.0, binary or JSON: accessors of all types, sparse ones, strips and fans,
/// KHR_mesh_quantization, EXT_mesh_gpu_instancing, KHR_draco_mesh_compression and EXT_meshopt_compression (if
/// built with these libraries), EXT_mesh_features and EXT_structural_metadata for names. Throws InputError,
/// without a file name, for other required extensions, for truncated data and for indices out of range.
[[nodiscard]] GltfModel read_gltf(std::string_view bytes, const FetchBytes& fetch);

}  // namespace canyon::meshes
