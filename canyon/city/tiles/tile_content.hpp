#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/json.hpp"
#include "canyon/city/fwd.hpp"
#include "canyon/city/meshes/gltf_model.hpp"

namespace canyon::tiles {

/// Texts of the features of a batch or property table, by feature id; vectors may be shorter than the table.
struct FeatureNames {
  std::vector<std::string> name;  ///< of "name", "gml_id", "id" ..., the first in the table
  std::vector<std::string> kind;  ///< of "class", "type", "feature_type" ...: the kind of feature
};

/// The surface given by words of a name or class: "WallSurface", "Building_12", "TINRelief", "tree". Empty if
/// there is none.
[[nodiscard]] std::optional<city::Surface> surface_by_word(std::string_view text);

/// A model of a tile's content, and its positions in the tile's own frame.
struct PosedModel {
  meshes::GltfModel model;
  std::map<std::uint32_t, FeatureNames> tables;  ///< of the model's property tables
  FeatureNames batch;                            ///< of primitives whose features are not in a property table
  std::vector<Eigen::Matrix4d> containments;     ///< from the glTF's frame; at least one
};

struct TileContent {
  std::vector<PosedModel> models;
  std::vector<std::string> left_out;  ///< kinds of content that are not supported: "points (pnts)"
};

/// Decodes b3dm, i3dm, cmpt (3D Tiles 1.0) and glTF. @param up the glTF's up axis, 'X', 'Y' (glTF's own) or
/// 'Z' (asset.gltfUpAxis of old tilesets); the tile's frame has z up. Throws InputError without a file name.
[[nodiscard]] TileContent read_content(std::string_view bytes, char up, const meshes::FetchBytes& fetch);

}  // namespace canyon::tiles
