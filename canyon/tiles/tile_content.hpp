#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/meshes/gltf_model.hpp"
#include "canyon/tiles/feature_names.hpp"

namespace canyon::tiles {

/// A model of a tile's content, and where it stands in the tile's own frame.
struct PlacedModel {
  meshes::GltfModel model;
  std::map<std::uint32_t, FeatureNames> tables;  ///< of the model's property tables
  FeatureNames batch;                            ///< of primitives whose features are of no property table
  std::vector<Eigen::Matrix4d> placements;       ///< from the glTF's frame; at least one
};

struct TileContent {
  std::vector<PlacedModel> models;
  std::vector<std::string> left_out;  ///< kinds of content that are not read: "points (pnts)"
};

/// Decodes b3dm, i3dm, cmpt (3D Tiles 1.0) and glTF. @param up the glTF's up axis, 'X', 'Y' (glTF's own) or
/// 'Z' (asset.gltfUpAxis of old tilesets); the tile's frame has z up. Throws InputError, which names no
/// file.
[[nodiscard]] TileContent read_content(std::string_view bytes, char up, const meshes::FetchBytes& fetch);

}  // namespace canyon::tiles
