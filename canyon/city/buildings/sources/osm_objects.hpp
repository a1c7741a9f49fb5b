#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/city/buildings/sources/map_data.hpp"
#include "canyon/city/buildings/sources/osm_reader.hpp"

namespace canyon::buildings {

/// The kind of feature that an OSM object's tags describe.
struct OsmClass {
  std::optional<FeatureKind> kind;  ///< empty: nothing of interest
  std::string left_out;             ///< why it is not built although it is of that kind; empty: it is
};

/// Reasons in OsmClass::left_out that may be mistakes of the map: these are warnings.
inline constexpr const char* kEnded = "with an end_date";
inline constexpr const char* kBelow = "with zero storeys above the ground and some below";

/// True where a key can matter to classify(): a quick sieve.
[[nodiscard]] bool key_matters(std::string_view key, bool foliage);

/// Sorts a way or relation by its tags. An object with both `building` and `building:part` is a Building:
/// other parts cut their share out of it.
[[nodiscard]] OsmClass classify(const TagMap& tags, bool foliage);

/// True where the tags say nothing about the object itself (type, source, notes): an old-style multipolygon,
/// whose outer ways carry the tags.
[[nodiscard]] bool says_nothing(const TagMap& tags);

/// Ids below zero are of objects that no server has seen (JOSM), and count in their file alone: those of the
/// n-th file (from 0) are lower by n * kOwnIds.
using OsmId = std::int64_t;
inline constexpr OsmId kOwnIds = OsmId{1} << 48;
/// "way/123"; "way/-1@2" of the second file.
[[nodiscard]] std::string osm_name(const char* kind, OsmId id);

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
