#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "canyon/buildings/sources/map_data.hpp"

namespace canyon::buildings {

/// The kind of feature that an OSM object's tags describe.
struct OsmClass {
  std::optional<FeatureKind> kind;  ///< empty: nothing of interest
  std::string left_out;             ///< why it is not built although it is of that kind; empty: it is
};

/// True where a key can matter to classify(): a quick sieve.
[[nodiscard]] bool key_matters(std::string_view key, bool foliage);

/// Sorts a way or relation by its tags. An object with both `building` and `building:part` is a Building:
/// other parts cut their share out of it.
[[nodiscard]] OsmClass classify(const TagMap& tags, bool foliage);

/// True where the tags say nothing about the object itself (type, source, notes): an old-style multipolygon,
/// whose outer ways carry the tags.
[[nodiscard]] bool says_nothing(const TagMap& tags);

}  // namespace canyon::buildings
