#pragma once

#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/city/buildings/sources/map_data.hpp"

namespace canyon::buildings {

struct OsmReadOptions {
  std::optional<LonLatBox> box;  ///< only features that touch it
  bool foliage = false;          ///< trees, tree rows, woods too
};

/// Streets for cars, as a graph.
struct StreetMap {
  std::vector<LonLat> positions;
  std::vector<std::pair<std::size_t, std::size_t>> pieces;  ///< connect two of `positions`
};
/// The streets of a map: ways tagged highway from trunk to residential, living_street and unclassified,
/// except tunnels, areas and ways without positions. May be empty. Throws InputError as read_osm() does.
[[nodiscard]] StreetMap read_streets(const std::vector<std::filesystem::path>& paths);

/// Reads OpenStreetMap .osm, .osm.gz, .osm.bz2, .osm.pbf through libosmium, detected by content: closed ways
/// and multipolygon relations (several outers, inners; old-style ones whose outer ways have the tags) tagged
/// building or building:part, type=building relations (roles outline and part give kind and `belongs_to`, and
/// the relation's tags complete the outline's). A multipolygon replaces its tagged outer ways, unless all its
/// members are whole buildings: then the members replace it. Of repeated objects the highest version is read.
///
/// Omitted, and counted in `warnings`: underground (location=underground, layer < 0 without height or
/// building:levels that show a building above ground), demolished, razed, abandoned-in-name
/// (demolished:building, ...), building=no, indoor features, points tagged building. Incomplete relations and
/// ways with missing nodes are skipped with a warning that names the id (the first twenty of a kind). Rings
/// that cross are kept unchanged, for repair().
///
/// With a box, features that touch it are complete, and the parts of touching buildings are kept too (those
/// within 0.02 deg of the box). Memory grows with the kept features, not with the file.
/// Throws InputError: missing or truncated file, another format; coordinates beyond the poles; no building.
[[nodiscard]] MapData read_osm(const std::vector<std::filesystem::path>& paths,
                               const OsmReadOptions& options = {});

}  // namespace canyon::buildings
