// The only file that reads OSM formats: libosmium's readers, and their errors turned into InputError.
#include "canyon/buildings/sources/osm_objects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <new>
#include <optional>
#include <osmium/io/any_compression.hpp>
#include <osmium/io/file.hpp>
#include <osmium/io/pbf_input.hpp>
#include <osmium/io/reader.hpp>
#include <osmium/io/xml_input.hpp>
#include <osmium/osm.hpp>
#include <stdexcept>
#include <string_view>

#include "canyon/base/archives.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/input_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/base/utf16.hpp"
#include "canyon/buildings/sources/osm_text.hpp"

namespace canyon::buildings {
namespace {

/// No wall is longer than this: who touches the box has a node in the widened one.
constexpr double kBoxMargin_deg = 0.02;

constexpr const char* kUtf16 = "utf-16";

/// libosmium's name of the format, or kUtf16, by content, since downloads lose their suffix.
std::string sniff_format(const std::filesystem::path& path) {
  check_input_file(path);
  std::ifstream in(path, std::ios::binary);
  std::string head(512, '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  if (in.bad() || (!in.is_open())) throw InputError(path, 0, "cannot be read");
  head.resize(static_cast<std::size_t>(in.gcount()));
  if (head.empty()) throw InputError(path, 0, "is empty", "fetch the map again");
  const std::string_view view(head);
  if (is_gzip(view)) return "osm.gz";
  if (is_bzip2(view)) return "osm.bz2";
  if (is_unpacked_whole(view)) throw InputError(path, 0, "is a packed file", "unpack it first");
  refuse_foreign_bytes(path, view);
  // A PBF file begins with the length of a BlobHeader whose type is "OSMHeader".
  if (view[0] == '\0' && view.substr(0, 64).find("OSMHeader") != std::string_view::npos) return "pbf";
  if (Utf16Decoder::is_marked(view)) return kUtf16;
  std::size_t start = view.substr(0, 3) == "\xEF\xBB\xBF" ? 3 : 0;
  start = view.find_first_not_of(" \t\r\n", start);
  if (start != std::string_view::npos && view[start] == '<') return "osm";
  if (start != std::string_view::npos && view[start] == '{') return "json";
  throw InputError(path, 0, "is not an OpenStreetMap file",
                   "give an extract as .osm, .osm.gz, .osm.bz2, .osm.pbf or Overpass JSON");
}

/// A map file, or its text where that had to be changed for libosmium.
struct MapSource {
  std::filesystem::path path;
  std::string format;
  std::optional<std::string> text;
};

/// Calls `use` with one piece of a file's text after the other, unpacked. Throws what libosmium throws.
template <typename Use>
void for_each_piece(const std::filesystem::path& path, const std::string& format, const Use& use) {
  const osmium::io::File file{std::filesystem::absolute(path).string(), format};
  const auto packed = osmium::io::CompressionFactory::instance().create_decompressor(
      file.compression(), osmium::io::detail::open_for_reading(file.filename()));
  for (std::string piece = packed->read(); !piece.empty(); piece = packed->read()) use(piece);
  packed->close();
}

bool has_error_remark(std::string_view text) {
  constexpr std::string_view kRemark = "<remark>";
  const std::size_t at = text.find(kRemark);
  return at != std::string_view::npos && trim(text.substr(at + kRemark.size())).starts_with("runtime error");
}

/// The text of an XML file that libosmium would not read as it is meant, made plain; empty for others, which
/// may be larger than memory, and for damaged ones, which the reader refuses.
std::optional<std::string> odd_xml(const std::filesystem::path& path, const std::string& format) {
  constexpr std::size_t kLongestTag = 4096;
  constexpr std::size_t kLargest = std::size_t{1} << 28;  // editors save no larger maps
  bool odd = false, gave_up = false;
  std::string text;
  try {
    for_each_piece(path, format, [&](const std::string& piece) {
      text.erase(0, text.size() - std::min(text.size(), kLongestTag));
      text += piece;
      odd = odd || needs_plain_xml(std::string_view(text).substr(0, text.rfind('<')));
      gave_up = gave_up || has_error_remark(text);
    });
    text.clear();
    if (odd && !gave_up) {
      for_each_piece(path, format, [&](const std::string& piece) {
        text += piece;
        if (text.size() > kLargest) throw std::length_error("not the work of an editor");
      });
    }
  } catch (const std::exception&) {
    return std::nullopt;
  }
  if (gave_up) {
    throw InputError(path, 0, "Overpass gave up: a part of the map is missing",
                     "fetch it again with more time, or in smaller pieces");
  }
  if (!odd) return std::nullopt;
  return plain_osm_xml(text);
}

MapSource open_source(const std::filesystem::path& path) {
  MapSource source{path, sniff_format(path), {}};
  if (source.format == "json") {
    source.text = osm_xml_from_overpass(path, TextFile(path).text());
  } else if (source.format == kUtf16) {
    source.text = plain_osm_xml(std::string(TextFile(path).text()));
  } else if (source.format != "pbf") {
    source.text = odd_xml(path, source.format);
  }
  if (source.text) source.format = "osm";
  return source;
}

/// Throws osmium::pbf_error for a blob without a type: libosmium compares it by a null pointer.
void check_blob_types(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::array<unsigned char, 4> length{};
  std::string header;
  while (in.read(reinterpret_cast<char*>(length.data()), length.size())) {
    const std::uint32_t size = std::uint32_t{length[0]} << 24 | std::uint32_t{length[1]} << 16 |
                               std::uint32_t{length[2]} << 8 | length[3];
    if (size > static_cast<std::uint32_t>(osmium::io::detail::max_blob_header_size))
      return;  // libosmium says so
    header.resize(size);
    if (!in.read(header.data(), size)) return;
    constexpr int kType = 1, kDataSize = 3;  // fileformat.proto
    bool typed = false;
    std::int32_t data_size = 0;
    for (protozero::pbf_reader blob(header); blob.next();) {
      if (blob.tag() == kType && blob.wire_type() == protozero::pbf_wire_type::length_delimited) {
        typed = blob.get_view().size() > 0;
      } else if (blob.tag() == kDataSize && blob.wire_type() == protozero::pbf_wire_type::varint) {
        data_size = blob.get_int32();
      } else {
        blob.skip();
      }
    }
    if (!typed) throw osmium::pbf_error("a blob has no type");
    if (data_size < 0) return;
    in.seekg(data_size, std::ios::cur);
  }
}

/// Throws osmium::pbf_error for tags with a zero byte within: libosmium looks for their ends, which may be
/// beyond the list.
void check_tags(const osmium::TagList& tags) {
  const auto* const bytes = reinterpret_cast<const unsigned char*>(&tags);
  const unsigned char* const begin = bytes + sizeof(osmium::TagList);
  const unsigned char* const end = bytes + tags.byte_size();
  if (begin == end) return;
  if (end[-1] != 0 || std::count(begin, end, 0) % 2 != 0) throw osmium::pbf_error("a tag has a zero byte");
}

/// Calls `use` with each object of the kinds `bits` in each file, those that are not visible among them.
template <typename Use>
void for_each_object(const std::vector<MapSource>& sources, osmium::osm_entity_bits::type bits,
                     const Use& use) {
  for (const MapSource& source : sources) {
    const std::filesystem::path& path = source.path;
    try {
      if (source.format == "pbf") check_blob_types(path);
      // An absolute path, since libosmium reads "-" and "http:" as something else.
      const osmium::io::File file =
          source.text ? osmium::io::File{source.text->data(), source.text->size(), source.format}
                      : osmium::io::File{std::filesystem::absolute(path).string(), source.format};
      osmium::io::Reader reader{file, bits};
      while (const osmium::memory::Buffer buffer = reader.read()) {
        for (const auto& object : buffer.select<osmium::OSMObject>()) {
          check_tags(object.tags());
          use(path, object);
        }
      }
      reader.close();
    } catch (const InputError&) {
      throw;
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const osmium::xml_error& error) {
      const std::string_view what = error.what();
      if (what.find("top-level") != std::string_view::npos) {
        throw InputError(path, static_cast<int>(error.line), "is XML, but no OpenStreetMap data",
                         "give an extract whose first element is <osm>");
      }
      throw InputError(path, static_cast<int>(error.line), fmt::format("is cut short or damaged ({})", what),
                       "fetch it again");
    } catch (const osmium::format_version_error& error) {
      throw InputError(path, 0, fmt::format("is OpenStreetMap data of version '{}'", error.version),
                       "version 0.6 is read: fetch a new extract");
    } catch (const osmium::invalid_location& error) {
      throw InputError(
          path, 0,
          fmt::format("holds a coordinate that is not a number or beyond the Earth ({})", error.what()));
    } catch (const std::exception& error) {
      throw InputError(path, 0, fmt::format("is cut short or damaged ({})", error.what()), "fetch it again");
    }
  }
}

TagMap tag_map(const osmium::TagList& list) {
  TagMap tags;
  for (const osmium::Tag& tag : list) tags.emplace(tag.key(), tag.value());
  return tags;
}

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

/// Objects that a history, a change file or an editor says are deleted, by the latest such version.
class Deletions {
 public:
  /// Whether an object is one; it is noted then.
  bool note(const osmium::OSMObject& object) {
    if (object.visible()) return false;
    std::uint32_t& version = versions_[object.id()];
    version = std::max(version, object.version());
    return true;
  }
  template <typename Object>
  void apply(std::map<OsmId, Object>& objects) const {
    for (const auto& [id, version] : versions_) {
      const auto found = objects.find(id);
      if (found != objects.end() && found->second.version <= version) objects.erase(found);
    }
  }

 private:
  std::map<OsmId, std::uint32_t> versions_;
};

/// The place in `objects` for a new version of an object; nullptr where a newer one is already there.
template <typename Object>
Object* place_for(std::map<OsmId, Object>& objects, OsmId id, std::uint32_t version) {
  const auto [at, fresh] = objects.try_emplace(id);
  if (!fresh && at->second.version >= version) return nullptr;
  at->second = Object{};
  at->second.version = version;
  return &at->second;
}

constexpr const char* kGivenTwice = "given twice in one version with other contents: the first counts";

/// Objects without tags stand beside others of theirs in extracts of several parts.
bool tags_contradict(const TagMap& one, const TagMap& other) {
  return !one.empty() && !other.empty() && one != other;
}

class ObjectReader {
 public:
  ObjectReader(const std::vector<std::filesystem::path>& paths, const OsmReadOptions& options)
      : options_(options) {
    for (const auto& path : paths) sources_.push_back(open_source(path));
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
    read_ways();
    if (options_.box) drop_what_is_far();
    read_nodes();
    resolve();
    return std::move(objects_);
  }

 private:
  void remark(const char* what, const osmium::OSMObject& object) {
    objects_.remarks.emplace_back(
        what, fmt::format("{}/{}", osmium::item_type_to_name(object.type()), object.id()));
  }

  [[nodiscard]] bool is_foliage_left_out(const osmium::TagList& tags) const {
    return !options_.foliage && (tags.has_tag("natural", "tree") || tags.has_tag("natural", "tree_row") ||
                                 tags.has_tag("natural", "wood") || tags.has_tag("landuse", "forest"));
  }

  void read_relations() {
    Deletions deleted;
    for_each_object(sources_, osmium::osm_entity_bits::relation,
                    [&](const std::filesystem::path&, const osmium::OSMObject& object) {
                      if (!deleted.note(object)) add_relation(static_cast<const osmium::Relation&>(object));
                    });
    deleted.apply(objects_.relations);
    for (const auto& [id, relation] : objects_.relations) {
      for (const OsmMember& member : relation.members) {
        if (member.type == 'w') member_ways_.push_back(member.ref);
      }
    }
    make_set(member_ways_);
  }

  void add_relation(const osmium::Relation& relation) {
    const char* type = relation.tags()["type"];
    if (type == nullptr) return;
    const bool multipolygon = std::string_view(type) == "multipolygon";
    if (!multipolygon && std::string_view(type) != "building") return;
    TagMap tags = tag_map(relation.tags());
    OsmClass kind = classify(tags, options_.foliage);
    if (multipolygon && !kind.kind && !says_nothing(tags)) return;
    OsmRelation* place = place_for(objects_.relations, relation.id(), relation.version());
    if (place == nullptr) {
      const OsmRelation& other = objects_.relations.at(relation.id());
      if (other.version == relation.version() &&
          (other.members.size() != relation.members().size() || tags_contradict(other.tags, tags)))
        remark(kGivenTwice, relation);
      return;
    }
    place->tags = std::move(tags);
    place->kind = std::move(kind);
    place->multipolygon = multipolygon;
    for (const osmium::RelationMember& member : relation.members()) {
      place->members.push_back({osmium::item_type_to_char(member.type()), member.ref(), member.role()});
    }
  }

  [[nodiscard]] bool in_wide_box(const osmium::Location& location) const {
    const double lon = longitude_near(location.lon_without_check(), *middle_longitude_);
    const double lat = location.lat_without_check();
    return lon >= wide_.west && lon <= wide_.east && lat >= wide_.south && lat <= wide_.north;
  }

  void read_nodes_in_box() {
    for_each_object(sources_, osmium::osm_entity_bits::node,
                    [&](const std::filesystem::path&, const osmium::OSMObject& object) {
                      const auto& node = static_cast<const osmium::Node&>(object);
                      if (node.visible() && node.location().valid() && in_wide_box(node.location())) {
                        nodes_in_box_.push_back(node.id());
                      }
                    });
    make_set(nodes_in_box_);
  }

  void read_ways() {
    Deletions deleted;
    for_each_object(sources_, osmium::osm_entity_bits::way,
                    [&](const std::filesystem::path&, const osmium::OSMObject& object) {
                      if (!deleted.note(object)) add_way(static_cast<const osmium::Way&>(object));
                    });
    deleted.apply(objects_.ways);
  }

  void add_way(const osmium::Way& way) {
    for (const osmium::Tag& tag : way.tags())
      if (!misspelt_key(tag.key()).empty()) objects_.misspelt[tag.key()].push_back(way.id());
    const bool member = contains(member_ways_, way.id());
    const bool foliage = is_foliage_left_out(way.tags());
    if (!member && !foliage && !tags_matter(way.tags(), options_.foliage)) return;
    OsmWay fresh;
    fresh.version = way.version();
    fresh.tags = tag_map(way.tags());
    fresh.kind = classify(fresh.tags, options_.foliage);
    if (!member && !foliage && !fresh.kind.kind) return;
    for (const osmium::NodeRef& node : way.nodes()) {
      fresh.nodes.push_back(node.ref());
      // "out geom" of Overpass and osmium's add-locations-to-ways put the places here.
      const bool placed = node.location().valid();
      if (placed) places_in_ways_.emplace(node.ref(), node.location());
      fresh.near_box =
          fresh.near_box || contains(nodes_in_box_, node.ref()) || (placed && in_wide_box(node.location()));
    }
    if (options_.box && !member && !fresh.near_box) return;
    if (foliage && !fresh.kind.kind) {
      ++objects_.foliage_left_out;
      if (!member) return;
    }
    OsmWay* place = place_for(objects_.ways, way.id(), way.version());
    if (place != nullptr) {
      *place = std::move(fresh);
    } else if (const OsmWay& other = objects_.ways.at(way.id()); other.version == fresh.version) {
      if (other.nodes != fresh.nodes || tags_contradict(other.tags, fresh.tags)) remark(kGivenTwice, way);
    }
  }

  /// Members of relations were kept wherever they are.
  void drop_what_is_far() {
    std::vector<OsmId> keep;
    for (auto at = objects_.relations.begin(); at != objects_.relations.end();) {
      const auto& members = at->second.members;
      const bool close = std::any_of(members.begin(), members.end(), [&](const OsmMember& member) {
        if (member.type == 'r') return true;  // of a type=building relation; few
        const auto way = objects_.ways.find(member.ref);
        return member.type == 'w' && way != objects_.ways.end() && way->second.near_box;
      });
      if (!close) {
        at = objects_.relations.erase(at);
        continue;
      }
      for (const OsmMember& member : members) {
        if (member.type == 'w') keep.push_back(member.ref);
      }
      ++at;
    }
    make_set(keep);
    for (auto at = objects_.ways.begin(); at != objects_.ways.end();) {
      at = contains(keep, at->first) || at->second.near_box ? std::next(at) : objects_.ways.erase(at);
    }
    nodes_in_box_ = {};
  }

  void read_nodes() {
    for (const auto& [id, way] : objects_.ways) {
      wanted_.insert(wanted_.end(), way.nodes.begin(), way.nodes.end());
    }
    make_set(wanted_);
    Deletions deleted;
    places_.resize(wanted_.size());
    versions_.resize(wanted_.size());
    for_each_object(sources_, osmium::osm_entity_bits::node,
                    [&](const std::filesystem::path&, const osmium::OSMObject& object) {
                      if (!deleted.note(object)) add_node(static_cast<const osmium::Node&>(object));
                    });
    deleted.apply(objects_.trees);
  }

  void add_node(const osmium::Node& node) {
    const auto found = std::lower_bound(wanted_.begin(), wanted_.end(), node.id());
    const bool wanted = found != wanted_.end() && *found == node.id();
    const bool tagged = !node.tags().empty() && tags_matter(node.tags(), options_.foliage);
    if (is_foliage_left_out(node.tags()) && node.location().valid() &&
        (!options_.box || in_wide_box(node.location()))) {
      ++objects_.foliage_left_out;
    }
    if ((!wanted && !tagged) || node.location().is_undefined()) return;
    if (!node.location().valid())
      return remark("nodes beyond the poles or the antimeridian (longitude 180 deg), left out", node);
    if (wanted) {
      const auto at = static_cast<std::size_t>(found - wanted_.begin());
      if (places_[at].is_defined() && node.version() == versions_[at] && places_[at] != node.location())
        remark(kGivenTwice, node);
      if (places_[at].is_undefined() || node.version() > versions_[at]) {
        places_[at] = node.location();
        versions_[at] = node.version();
      }
    }
    if (!tagged || (options_.box && !in_wide_box(node.location()))) return;
    TagMap tags = tag_map(node.tags());
    const OsmClass kind = classify(tags, options_.foliage);
    if (!kind.kind) return;
    if (*kind.kind == FeatureKind::Tree) {
      OsmTree* place = place_for(objects_.trees, node.id(), node.version());
      if (place == nullptr) return;
      place->tags = std::move(tags);
      place->place = place_of(node.location());
    } else if (*kind.kind == FeatureKind::Building && kind.left_out.empty()) {
      remark("points tagged building, left out since they have no outline", node);
    }
  }

  [[nodiscard]] osmium::Location location_of(OsmId node) const {
    const auto at =
        static_cast<std::size_t>(std::lower_bound(wanted_.begin(), wanted_.end(), node) - wanted_.begin());
    if (places_[at].is_defined()) return places_[at];
    const auto found = places_in_ways_.find(node);
    return found != places_in_ways_.end() && found->second.valid() ? found->second : osmium::Location();
  }

  /// Longitudes near the middle of the box, else near the first place that is asked for.
  [[nodiscard]] LonLat place_of(const osmium::Location& location) {
    if (!middle_longitude_) middle_longitude_ = location.lon();
    return {longitude_near(location.lon(), *middle_longitude_), location.lat()};
  }

  void resolve() {
    for (auto& [id, way] : objects_.ways) {
      way.places.reserve(way.nodes.size());
      for (const OsmId node : way.nodes) {
        const osmium::Location location = location_of(node);
        if (location.is_undefined()) break;
        way.places.push_back(place_of(location));
      }
      if (way.places.size() != way.nodes.size()) way.places.clear();
    }
  }

  std::vector<MapSource> sources_;
  const OsmReadOptions& options_;
  LonLatBox wide_;                          ///< unwrapped
  std::optional<double> middle_longitude_;  ///< [deg]
  OsmObjects objects_;
  std::vector<OsmId> member_ways_;   ///< sorted
  std::vector<OsmId> nodes_in_box_;  ///< sorted
  std::vector<OsmId> wanted_;        ///< sorted; the two below go with it
  std::vector<osmium::Location> places_;
  std::vector<std::uint32_t> versions_;
  std::unordered_map<OsmId, osmium::Location> places_in_ways_;
};

}  // namespace

OsmObjects read_osm_objects(const std::vector<std::filesystem::path>& paths, const OsmReadOptions& options) {
  return ObjectReader(paths, options).read();
}

}  // namespace canyon::buildings
