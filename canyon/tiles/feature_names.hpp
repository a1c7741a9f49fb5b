#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/json.hpp"
#include "canyon/city/fwd.hpp"

namespace canyon::tiles {

/// Texts of the features of a batch or property table, by feature id; vectors may be shorter than the table.
struct FeatureNames {
  std::vector<std::string> name;  ///< of "name", "gml_id", "id" ... whichever the table has first
  std::vector<std::string> kind;  ///< of "class", "type", "feature_type" ...: what the feature is
};

/// Texts of a table by column, one for each feature.
using TextColumns = std::map<std::string, std::vector<std::string>>;
[[nodiscard]] FeatureNames feature_names(const TextColumns& columns);

/// The names of a b3dm or i3dm batch table (3D Tiles 1.0, "Batch Table"): its lists in JSON, and the classes
/// of 3DTILES_batch_table_hierarchy. Lists in the binary part hold numbers only and are not read.
[[nodiscard]] FeatureNames batch_names(const Json& table);

/// The surface that words of a name or class say: "WallSurface", "Building_12", "TINRelief", "tree". Empty
/// where none does.
[[nodiscard]] std::optional<city::Surface> surface_by_word(std::string_view text);

}  // namespace canyon::tiles
