#include "canyon/city/buildings/sources/osm_objects.hpp"

#include <fmt/format.h>
#include <osmium/osm.hpp>

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>

#include "canyon/base/text.hpp"
#include "canyon/city/buildings/sources/osm_file.hpp"
#include "canyon/city/buildings/sources/shape.hpp"

namespace canyon::buildings {
namespace {

/// Longer walls do not occur: a feature that touches the box has a node in the widened one.
constexpr double kBoxMargin_deg = 0.02;

bool tags_matter(const osmium::TagList& list, bool foliage) {
  return std::any_of(list.begin(), list.end(),
                     [&](const osmium::Tag& tag) { return key_matters(tag.key(), foliage); });
}

void make_set(std::vector<OsmId>& ids) {
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
}

bool contains(const std::vector<OsmId>& set, OsmId id) {
  return std::binary_search(set.begin(), set.end(), id);
}

/// The entry in `objects` for a new version of an object; nullptr if it already has a newer one.
template <typename Object>
Object* slot_for(std::map<OsmId, Object>& objects, OsmId id, std::uint32_t version) {
  const auto [at, fresh] = objects.try_emplace(id);
  if (!fresh && at->second.version >= version) return nullptr;
  at->second = Object{};
  at->second.version = version;
  return &at->second;
}

/// Calls `add` with each visible object, which stores relevant ones by slot_for(). Drops objects whose newer
/// version is deleted or not relevant. In a single file sorted by id, no object occurs twice.
template <typename Object, typename Add>
void read_newest(const std::vector<OsmFile>& files, osmium::osm_entity_bits::type bits,
                 std::map<OsmId, Object>& objects, const Add& add) {
  bool each_once = files.size() == 1;
  OsmId last = std::numeric_limits<OsmId>::min();
  for_each_object(files, bits, [&](const osmium::OSMObject& object) {
    each_once = each_once && object.id() > last;
    last = object.id();
    if (object.visible()) add(object);
  });
  if (each_once || objects.empty()) return;
  for_each_object(files, bits, [&](const osmium::OSMObject& object) {
    const auto kept = objects.find(object.id());
    if (kept == objects.end()) return;
    const std::uint32_t version = kept->second.version;
    if (object.version() > version || (object.version() == version && !object.visible())) objects.erase(kept);
  });
}

class ObjectReader {
 public:
  ObjectReader(const std::vector<std::filesystem::path>& paths, const OsmReadOptions& options)
      : options_(options) {
    for (const auto& path : paths) files_.push_back(open_osm_file(path));
    if (options.box) {
      wide_ = options.box->unwrapped();
      middle_longitude_ = options.box->middle_longitude();
      wide_.west -= kBoxMargin_deg;
      wide_.south -= kBoxMargin_deg;
      wide_.east += kBoxMargin_deg;
      wide_.north += kBoxMargin_deg;
    }
  }

  OsmObjects read() {
    read_relations();
    if (options_.box) read_nodes_in_box();
    read_osm_ways();
    if (options_.box) drop_what_is_far();
    read_nodes();
    resolve();
    return std::move(objects_);
  }

 private:
  void add_counted(ReadReport::Level level, const char* what, const osmium::OSMObject& object) {
    objects_.notes.add_counted(level, what, osm_name(osmium::item_type_to_name(object.type()), object.id()));
  }

  /// The relevant tags of an object.
  static TagMap tags_of(const osmium::OSMObject& object) {
    TagMap tags;
    for (const osmium::Tag& tag : object.tags()) tags.emplace(tag.key(), tag.value());
    return tags;
  }

  [[nodiscard]] bool is_foliage_left_out(const osmium::TagList& tags) const {
    return !options_.foliage && (tags.has_tag("natural", "tree") || tags.has_tag("natural", "tree_row") ||
                                 tags.has_tag("natural", "wood") || tags.has_tag("landuse", "forest"));
  }

  void read_relations() {
    read_newest(
        files_, osmium::osm_entity_bits::relation, objects_.relations,
        [&](const osmium::OSMObject& object) { add_relation(static_cast<const osmium::Relation&>(object)); });
    for (const auto& [id, relation] : objects_.relations) {
      for (const OsmMember& member : relation.members)
        if (member.type == 'w') member_osm_ways_.push_back(member.ref);
    }
    make_set(member_osm_ways_);
  }

  void add_relation(const osmium::Relation& relation) {
    const char* type = relation.tags()["type"];
    if (type == nullptr) return;
    const bool multipolygon = std::string_view(type) == "multipolygon";
    if (!multipolygon && std::string_view(type) != "building") return;
    TagMap tags = tags_of(relation);
    OsmClass kind = classify(tags, options_.foliage);
    if (multipolygon && !kind.kind && !is_uninformative(tags)) return;
    OsmRelation* position = slot_for(objects_.relations, relation.id(), relation.version());
    if (position == nullptr) return;
    position->tags = std::move(tags);
    position->kind = std::move(kind);
    position->multipolygon = multipolygon;
    for (const osmium::RelationMember& member : relation.members())
      position->members.push_back({osmium::item_type_to_char(member.type()), member.ref(), member.role()});
  }

  [[nodiscard]] bool in_wide_box(const osmium::Location& location) const {
    const double lon = longitude_near(location.lon_without_check(), *middle_longitude_);
    const double lat = location.lat_without_check();
    return lon >= wide_.west && lon <= wide_.east && lat >= wide_.south && lat <= wide_.north;
  }

  void read_nodes_in_box() {
    for_each_object(files_, osmium::osm_entity_bits::node, [&](const osmium::OSMObject& object) {
      const auto& node = static_cast<const osmium::Node&>(object);
      if (node.visible() && node.location().valid() && in_wide_box(node.location()))
        nodes_in_box_.push_back(node.id());
    });
    make_set(nodes_in_box_);
  }

  void read_osm_ways() {
    read_newest(files_, osmium::osm_entity_bits::way, objects_.ways,
                [&](const osmium::OSMObject& object) { add_way(static_cast<const osmium::Way&>(object)); });
  }

  void add_way(const osmium::Way& transmitter_path) {
    const bool member = contains(member_osm_ways_, transmitter_path.id());
    const bool foliage = is_foliage_left_out(transmitter_path.tags());
    if (!member && !foliage && !tags_matter(transmitter_path.tags(), options_.foliage)) return;
    OsmWay fresh;
    fresh.version = transmitter_path.version();
    fresh.tags = tags_of(transmitter_path);
    fresh.kind = classify(fresh.tags, options_.foliage);
    if (!member && !foliage && !fresh.kind.kind) return;
    const auto known = objects_.ways.find(transmitter_path.id());
    const bool newer = known != objects_.ways.end() && known->second.version < fresh.version;
    for (const osmium::NodeRef& node : transmitter_path.nodes()) {
      fresh.nodes.push_back(node.ref());
      // "out geom" of Overpass and osmium's add-locations-to-ways write the positions here.
      const bool is_located = node.location().valid();
      if (is_located && !node_locations_.emplace(node.ref(), node.location()).second && newer)
        node_locations_[node.ref()] = node.location();
      fresh.near_box = fresh.near_box || contains(nodes_in_box_, node.ref()) ||
                       (is_located && in_wide_box(node.location()));
    }
    if (options_.box && !member && !fresh.near_box) return;
    if (foliage && !fresh.kind.kind) {
      ++objects_.foliage_left_out;
      if (!member) return;
    }
    if (OsmWay* position = slot_for(objects_.ways, transmitter_path.id(), transmitter_path.version()))
      *position = std::move(fresh);
  }

  /// Members of relations were kept at any position.
  void drop_what_is_far() {
    std::vector<OsmId> keep;
    for (auto at = objects_.relations.begin(); at != objects_.relations.end();) {
      const auto& members = at->second.members;
      const bool close = std::any_of(members.begin(), members.end(), [&](const OsmMember& member) {
        if (member.type == 'r') return true;  // of a type=building relation; few
        const auto transmitter_path = objects_.ways.find(member.ref);
        return member.type == 'w' && transmitter_path != objects_.ways.end() &&
               transmitter_path->second.near_box;
      });
      if (!close) {
        at = objects_.relations.erase(at);
        continue;
      }
      for (const OsmMember& member : members)
        if (member.type == 'w') keep.push_back(member.ref);
      ++at;
    }
    make_set(keep);
    for (auto at = objects_.ways.begin(); at != objects_.ways.end();)
      at = contains(keep, at->first) || at->second.near_box ? std::next(at) : objects_.ways.erase(at);
    nodes_in_box_ = {};
  }

  void read_nodes() {
    for (const auto& [id, transmitter_path] : objects_.ways)
      wanted_.insert(wanted_.end(), transmitter_path.nodes.begin(), transmitter_path.nodes.end());
    make_set(wanted_);
    locations_.resize(wanted_.size());
    versions_.resize(wanted_.size());
    read_newest(files_, osmium::osm_entity_bits::node, objects_.trees,
                [&](const osmium::OSMObject& object) { add_node(static_cast<const osmium::Node&>(object)); });
  }

  void add_node(const osmium::Node& node) {
    const auto found = std::lower_bound(wanted_.begin(), wanted_.end(), node.id());
    const bool wanted = found != wanted_.end() && *found == node.id();
    const bool tagged = !node.tags().empty() && tags_matter(node.tags(), options_.foliage);
    if (is_foliage_left_out(node.tags()) && node.location().valid() &&
        (!options_.box || in_wide_box(node.location())))
      ++objects_.foliage_left_out;
    if ((!wanted && !tagged) || node.location().is_undefined()) return;
    if (!node.location().valid())
      return add_counted(ReadReport::Level::Loss,
                         "{} nodes beyond the poles or the antimeridian (longitude 180 deg), left out", node);
    if (wanted) {
      const auto at = static_cast<std::size_t>(found - wanted_.begin());
      if (locations_[at].is_undefined() || node.version() > versions_[at]) {
        locations_[at] = node.location();
        versions_[at] = node.version();
      }
    }
    if (!tagged || (options_.box && !in_wide_box(node.location()))) return;
    TagMap tags = tags_of(node);
    const OsmClass kind = classify(tags, options_.foliage);
    if (!kind.kind) return;
    if (*kind.kind == FeatureKind::Tree) {
      OsmTree* position = slot_for(objects_.trees, node.id(), node.version());
      if (position == nullptr) return;
      position->tags = std::move(tags);
      position->position = position_of(node.location());
    } else if (*kind.kind == FeatureKind::Building && kind.left_out.empty()) {
      add_counted(ReadReport::Level::Remark, "{} points tagged building, left out: no outline", node);
    }
  }

  [[nodiscard]] osmium::Location location_of(OsmId node) const {
    const auto at =
        static_cast<std::size_t>(std::lower_bound(wanted_.begin(), wanted_.end(), node) - wanted_.begin());
    if (locations_[at].is_defined()) return locations_[at];
    const auto found = node_locations_.find(node);
    return found != node_locations_.end() && found->second.valid() ? found->second : osmium::Location();
  }

  /// Longitudes near the middle of the box, else near the first position.
  [[nodiscard]] LonLat position_of(const osmium::Location& location) {
    if (!middle_longitude_) middle_longitude_ = location.lon();
    return {longitude_near(location.lon(), *middle_longitude_), location.lat()};
  }

  void resolve() {
    for (auto& [id, transmitter_path] : objects_.ways) {
      transmitter_path.positions.reserve(transmitter_path.nodes.size());
      for (const OsmId node : transmitter_path.nodes) {
        const osmium::Location location = location_of(node);
        if (location.is_undefined()) break;
        transmitter_path.positions.push_back(position_of(location));
      }
      if (transmitter_path.positions.size() != transmitter_path.nodes.size())
        transmitter_path.positions.clear();
    }
  }

  std::vector<OsmFile> files_;
  const OsmReadOptions& options_;
  LonLatBox wide_;                          ///< unwrapped
  std::optional<double> middle_longitude_;  ///< [deg]
  OsmObjects objects_;
  std::vector<OsmId> member_osm_ways_;  ///< sorted
  std::vector<OsmId> nodes_in_box_;     ///< sorted
  std::vector<OsmId> wanted_;           ///< sorted; the next two members have the same order
  std::vector<osmium::Location> locations_;
  std::vector<std::uint32_t> versions_;
  std::unordered_map<OsmId, osmium::Location> node_locations_;
};

bool is_street(const osmium::OSMObject& route) {
  const auto is_set = [&](const char* key) {
    return !std::string_view(route.tags().get_value_by_key(key, "no")).starts_with("no");
  };
  constexpr std::string_view kStreets[] = {"trunk",       "primary",       "secondary",   "tertiary",
                                           "residential", "living_street", "unclassified"};
  std::string_view kind = route.tags().get_value_by_key("highway", "");
  if (kind.ends_with("_link")) kind.remove_suffix(5);
  return !is_set("tunnel") && !is_set("area") &&
         std::find(std::begin(kStreets), std::end(kStreets), kind) != std::end(kStreets);
}

// Prefixes of things that no longer exist or do not exist yet (OSM wiki, "Lifecycle prefix").
constexpr std::array<std::string_view, 12> kLifecyclePrefixes{
    "demolished", "razed",    "removed", "destroyed",    "abandoned", "was",
    "dismantled", "proposed", "planned", "construction", "historic",  "ruined"};
// Values of the key "building", and keys on their own ("demolished=2019").
constexpr std::array<std::string_view, 6> kGoneValues{"demolished", "razed",      "removed",
                                                      "destroyed",  "dismantled", "collapsed"};
constexpr std::array<std::string_view, 3> kNotThereValues{"proposed", "planned", "was"};
// Only a tagged height of these is known.
constexpr std::array<std::string_view, 4> kUnfinishedValues{"construction", "ruins", "ruin", "foundation"};

// Values of "man_made" as high as buildings, which are mapped without the key building.
constexpr std::array<std::string_view, 7> kStructures{"silo",    "storage_tank",  "water_tower", "gasometer",
                                                      "chimney", "cooling_tower", "tower"};

/// An unused building still exists (OSM wiki, "Key:disused:*").
constexpr const char* kDisused = "disused:building";

bool positive(const std::string_view text) {
  const std::optional<double> value = parse_length_m(text);
  return value && *value > 0;
}

/// "demolished" of "demolished:building" and "demolished:building:part"; empty for other keys.
std::string_view lifecycle_prefix(std::string_view key) {
  const std::size_t colon = key.find(':');
  if (colon == std::string_view::npos) return {};
  const std::string_view rest = key.substr(colon + 1);
  if (rest != "building" && rest != "building:part") return {};
  const std::string_view prefix = key.substr(0, colon);
  return std::find(kLifecyclePrefixes.begin(), kLifecyclePrefixes.end(), prefix) != kLifecyclePrefixes.end()
             ? prefix
             : std::string_view();
}

bool is_no(std::string_view value) {
  const std::string word = lower_case(value);
  return word == "no" || word == "false" || word == "0" || word == "none";
}

/// Whether "-1", "-2;-1" and "-2--1" list storeys, and none above the ground.
bool all_below_ground(std::string_view levels) {
  const auto pieces = split(levels, ';');
  return !levels.empty() && std::all_of(pieces.begin(), pieces.end(), [](std::string_view piece) {
    piece = trim(piece);
    const std::size_t range = piece.find('-', 1);
    const auto first = parse_double(piece.substr(0, range));
    const auto last = range == std::string_view::npos ? first : parse_double(piece.substr(range + 1));
    return first && last && *first < 0 && *last < 0;
  });
}

/// Whether a tag shows that a building is above the ground.
bool rises(const TagMap& tags) {
  constexpr std::array kKeys{
      "height",      "building:height", "est_height", "building:levels", "building:levels:aboveground",
      "roof:levels", "roof:height"};
  return std::any_of(kKeys.begin(), kKeys.end(), [&](const char* key) { return positive(tag(tags, key)); });
}

bool underground(const TagMap& tags) {
  const std::string_view location = tag(tags, "location");
  if (location == "underground" || location == "below_ground" || location == "subsurface") return true;
  if (tag(tags, "parking") == "underground" || tag(tags, "underground") == "yes") return true;
  if (rises(tags)) return false;
  const std::optional<double> layer = parse_double(tag(tags, "layer"));
  if (layer && *layer < 0) return true;
  for (const char* key : {"level", "max_level", "building:levels"})
    if (all_below_ground(tag(tags, key))) return true;
  return false;
}

/// A road or railway under a roof or on a bridge. Passages through buildings are part of the buildings.
bool is_passage(const TagMap& tags) {
  if (tag(tags, "highway").empty() && tag(tags, "railway").empty()) return false;
  const auto has_tag = [&](const char* key) {
    const std::string_view value = tag(tags, key);
    return !value.empty() && !is_no(value) && value != "building_passage";
  };
  return has_tag("tunnel") || has_tag("covered") || has_tag("bridge");
}

std::string reason_to_leave_out(const TagMap& tags, std::string_view value) {
  const auto has_tag = [&](const auto& words, const auto& base_words) {
    return std::any_of(words.begin(), words.end(), [&](std::string_view word) {
      return value == word || base_words(tag(tags, std::string(word).c_str()));
    });
  };
  if (has_tag(kGoneValues,
              [](std::string_view own) {
                return !own.empty() && !is_no(own) && has_ended(own).value_or(true);
              }) ||
      has_tag(kNotThereValues, [](std::string_view own) { return own == "yes"; }))
    return "demolished or not built";
  const bool unfinished =
      std::find(kUnfinishedValues.begin(), kUnfinishedValues.end(), value) != kUnfinishedValues.end();
  if (unfinished && !rises(tags)) return "in ruins or under construction, without a height";
  const std::string_view end = tag(tags, "end_date");
  if (!end.empty() && has_ended(end).value_or(true)) return kEnded;
  const std::string_view indoor = tag(tags, "indoor");
  if ((!indoor.empty() && indoor != "no") || tag(tags, "location") == "indoor") return "indoor";
  if (underground(tags)) return "underground";
  const std::optional<double> levels = parse_double(tag(tags, "building:levels"));
  if (levels && *levels == 0 && positive(tag(tags, "building:levels:underground")) && !rises(tags))
    return kBelow;
  return {};
}

}  // namespace

std::string osm_name(const char* kind, OsmId id) {
  const OsmId file = id < 0 ? -(id / kGeneratedIds) : 0;
  return file == 0 ? fmt::format("{}/{}", kind, id)
                   : fmt::format("{}/{}@{}", kind, id + file * kGeneratedIds, file + 1);
}

OsmObjects read_osm_objects(const std::vector<std::filesystem::path>& paths, const OsmReadOptions& options) {
  return ObjectReader(paths, options).read();
}

StreetMap read_streets(const std::vector<std::filesystem::path>& paths) {
  std::vector<OsmFile> files;
  for (const auto& path : paths) files.push_back(open_osm_file(path));
  struct Street {
    std::uint32_t version = 0;
    std::vector<OsmId> nodes;
  };
  struct NodeLocation {
    std::uint32_t version = 0;
    osmium::Location location;
  };
  std::map<OsmId, Street> routes;
  std::map<OsmId, NodeLocation> indices;
  read_newest(files, osmium::osm_entity_bits::way, routes, [&](const osmium::OSMObject& object) {
    if (!is_street(object)) return;
    Street* street = slot_for(routes, object.id(), object.version());
    if (street == nullptr) return;
    for (const osmium::NodeRef& node : static_cast<const osmium::Way&>(object).nodes()) {
      street->nodes.push_back(node.ref());
      indices[node.ref()].location = node.location();  // most files store it only with the node
    }
  });
  for_each_object(files, osmium::osm_entity_bits::node, [&](const osmium::OSMObject& object) {
    const auto position = indices.find(object.id());
    if (position != indices.end() && object.visible() && object.version() >= position->second.version)
      position->second = {object.version(), static_cast<const osmium::Node&>(object).location()};
  });
  StreetMap streets;
  std::map<OsmId, std::size_t> index;
  for (const auto& [id, position] : indices) {
    if (!position.location.valid()) continue;
    index.emplace(id, streets.positions.size());
    streets.positions.emplace_back(position.location.lon(), position.location.lat());
  }
  for (const auto& [id, street] : routes) {
    for (std::size_t i = 1; i < street.nodes.size(); ++i) {
      const auto a = index.find(street.nodes[i - 1]), b = index.find(street.nodes[i]);
      if (a != index.end() && b != index.end()) streets.pieces.emplace_back(a->second, b->second);
    }
  }
  return streets;
}

bool key_matters(std::string_view key, bool foliage) {
  if (key == "building" || key == "building:part" || key == kDisused || !lifecycle_prefix(key).empty())
    return true;
  if (key == "tunnel" || key == "covered" || key == "bridge" || key == "man_made") return true;
  return foliage && (key == "natural" || key == "landuse");
}

OsmClass classify(const TagMap& tags, bool foliage) {
  std::string_view building = tag(tags, "building");
  if (building.empty()) building = tag(tags, kDisused);
  const std::string_view part = tag(tags, "building:part");
  if (!building.empty() && !is_no(building))
    return {FeatureKind::Building, reason_to_leave_out(tags, building)};
  if (!part.empty() && !is_no(part)) return {FeatureKind::Part, reason_to_leave_out(tags, part)};
  for (const auto& [key, value] : tags)
    if (!lifecycle_prefix(key).empty() && !is_no(trim(value)))
      return {FeatureKind::Building, "demolished or not built"};
  if (!building.empty()) return {FeatureKind::Building, "building=no"};
  if (std::find(kStructures.begin(), kStructures.end(), tag(tags, "man_made")) != kStructures.end())
    return {FeatureKind::Building, "man_made (silos, tanks, towers) without the key building"};
  if (foliage) {
    const std::string_view natural = tag(tags, "natural");
    if (natural == "wood" || tag(tags, "landuse") == "forest") return {FeatureKind::Wood, {}};
    if (natural == "tree_row") return {FeatureKind::TreeRow, {}};
    if (natural == "tree") return {FeatureKind::Tree, {}};
  }
  if (is_passage(tags)) return {FeatureKind::Passage, {}};
  return {};
}

bool is_uninformative(const TagMap& tags) {
  static constexpr std::array<std::string_view, 7> kSilent{"type",    "source", "created_by", "note",
                                                           "comment", "fixme",  "FIXME"};
  return std::all_of(tags.begin(), tags.end(), [](const auto& tag) {
    return std::find(kSilent.begin(), kSilent.end(), tag.first) != kSilent.end();
  });
}

}  // namespace canyon::buildings
