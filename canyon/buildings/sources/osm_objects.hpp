#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "canyon/buildings/sources/osm_reader.hpp"
#include "canyon/buildings/sources/osm_tags.hpp"

namespace canyon::buildings {

using OsmId = std::int64_t;

struct OsmWay {
  std::uint32_t version = 0;
  TagMap tags;
  OsmClass kind;
  std::vector<OsmId> nodes;
  bool near_box = false;       ///< with a box: a node of it lies in the widened box
  std::vector<LonLat> places;  ///< of `nodes`, once resolve() found them all; else empty
};

struct OsmMember {
  char type = 'w';  ///< n, w, r
  OsmId ref = 0;
  std::string role;
};

struct OsmRelation {
  std::uint32_t version = 0;
  TagMap tags;
  OsmClass kind;
  bool multipolygon = false;  ///< else type=building
  std::vector<OsmMember> members;
};

struct OsmTree {
  std::uint32_t version = 0;
  TagMap tags;
  LonLat place = LonLat::Zero();
};

/// The objects of several files that can matter, each id once (the highest version, or the first file's of
/// equal ones), ways with the places of their nodes.
struct OsmObjects {
  std::map<OsmId, OsmTree> trees;
  std::map<OsmId, OsmWay> ways;
  std::map<OsmId, OsmRelation> relations;
  ReadReport notes;                  ///< of single objects
  std::size_t foliage_left_out = 0;  ///< trees, tree rows and woods, where none are wanted
};

/// Reads in passes (relations, ways, nodes), so that memory goes with what is wanted, not with the files.
/// With a box, only what has a node in the box, widened by two hundredths of a degree, is kept, whole.
/// Throws InputError, as read_osm().
[[nodiscard]] OsmObjects read_osm_objects(const std::vector<std::filesystem::path>& paths,
                                          const OsmReadOptions& options);

}  // namespace canyon::buildings
