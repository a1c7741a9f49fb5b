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

/// The kind of feature that the tags of an OSM object describe.
struct OsmClass {
  std::optional<FeatureKind> kind;  ///< empty: not used
  std::string left_out;             ///< reason if it is not built although it has this kind; else empty
};

/// Reasons in OsmClass::left_out that may be mistakes in the map; these are warnings.
inline constexpr const char* kEnded = "with an end_date";
inline constexpr const char* kBelow = "with zero storeys above the ground and some below";

/// True if a key may matter to classify(): a fast filter.
[[nodiscard]] bool key_matters(std::string_view key, bool foliage);

/// Classifies a way or relation by its tags. An object with both `building` and `building:part` is a
/// Building; other parts are cut out of it.
[[nodiscard]] OsmClass classify(const TagMap& tags, bool foliage);

/// True if the tags describe only metadata (type, source, notes): an old-style multipolygon, whose outer ways
/// have the tags.
[[nodiscard]] bool is_uninformative(const TagMap& tags);

/// Ids below zero are of objects that were never uploaded to a server (JOSM), and are valid only in their
/// file: those of the n-th file (from 0) are lowered by n * kGeneratedIds.
using OsmId = std::int64_t;
inline constexpr OsmId kGeneratedIds = OsmId{1} << 48;
/// "way/123"; "way/-1@2" of the second file.
[[nodiscard]] std::string osm_name(const char* kind, OsmId id);

struct OsmWay {
  std::uint32_t version = 0;
  TagMap tags;
  OsmClass kind;
  std::vector<OsmId> nodes;
  bool near_box = false;          ///< with a box: it has a node in the widened box
  std::vector<LonLat> positions;  ///< of `nodes`, if resolve() found all of them; else empty
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
  LonLat position = LonLat::Zero();
};

/// The objects of several files that can matter, each id once (the highest version; of equal versions the
/// first file's), ways with the positions of their nodes.
struct OsmObjects {
  std::map<OsmId, OsmTree> trees;
  std::map<OsmId, OsmWay> ways;
  std::map<OsmId, OsmRelation> relations;
  ReadReport notes;                  ///< about single objects
  std::size_t foliage_left_out = 0;  ///< trees, tree rows and woods, if foliage is not enabled
};

/// Reads in passes (relations, ways, nodes), so that memory grows with the wanted objects, not with the
/// files. With a box, only objects with a node in the box, widened by two hundredths of a degree, are kept,
/// completely. Throws InputError as read_osm() does.
[[nodiscard]] OsmObjects read_osm_objects(const std::vector<std::filesystem::path>& paths,
                                          const OsmReadOptions& options);

}  // namespace canyon::buildings
