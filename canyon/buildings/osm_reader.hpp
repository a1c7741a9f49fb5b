#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "canyon/buildings/map_data.hpp"

namespace canyon::buildings {

struct OsmReadOptions {
  std::optional<LonLatBox> box;  ///< only features that touch it
  bool foliage = false;          ///< trees, tree rows, woods as well
};

/// Reads OpenStreetMap .osm, .osm.gz, .osm.bz2, .osm.pbf through libosmium: closed ways and multipolygon
/// relations (several outers, inners) tagged building or building:part, type=building relations (roles
/// outline and part). Left out, and counted: underground (location=underground, layer < 0 with no building
/// above ground), demolished, razed, abandoned-in-name (demolished:building, ...), building=no, indoor
/// features. Incomplete relations and ways with missing nodes are skipped with a warning that names the id.
/// Throws InputError: missing, truncated or foreign file; coordinates beyond the poles; no building at all.
[[nodiscard]] MapData read_osm(const std::vector<std::filesystem::path>& paths,
                               const OsmReadOptions& options = {});

}  // namespace canyon::buildings
