#include "canyon/city/buildings/sources/osm_file.hpp"

// The only file that reads OSM formats: uses libosmium's readers, and converts their errors to InputError.
#include "canyon/city/buildings/sources/osm_objects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <map>
#include <new>
#include <osmium/io/any_compression.hpp>
#include <osmium/io/file.hpp>
#include <osmium/io/pbf_input.hpp>
#include <osmium/io/reader.hpp>
#include <osmium/io/xml_input.hpp>
#include <osmium/osm.hpp>
#include <set>
#include <string_view>
#include <utility>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"

namespace canyon::buildings {

namespace {

constexpr std::string_view kBlanks = " \t\r\n";

/// One attribute with the blanks before it.
struct Attribute {
  std::string_view text, name, value;
};

/// The attribute at `at`, which moves past it; nothing at the end of a tag and in text that is not XML.
std::optional<Attribute> take_attribute(std::string_view xml, std::size_t& at) {
  const std::size_t begin = xml.find_first_not_of(kBlanks, at);
  const std::size_t equals = xml.find('=', at);
  if (begin == std::string_view::npos || equals == std::string_view::npos || xml[begin] == '>' ||
      xml[begin] == '/')
    return std::nullopt;
  const std::size_t quote = xml.find_first_not_of(kBlanks, equals + 1);
  if (quote == std::string_view::npos || (xml[quote] != '"' && xml[quote] != '\'')) return std::nullopt;
  const std::size_t end = xml.find(xml[quote], quote + 1);
  if (end == std::string_view::npos) return std::nullopt;
  Attribute attribute{xml.substr(at, end + 1 - at), xml.substr(begin, equals - begin),
                      xml.substr(quote + 1, end - quote - 1)};
  attribute.name = attribute.name.substr(0, attribute.name.find_first_of(kBlanks));
  at = end + 1;
  return attribute;
}

/// Writes OSM XML from Overpass's elements.
class OverpassXml {
 public:
  std::string take(const Json& elements) {
    for (const Json& element : elements.items())
      if (element["type"] == "way") ways_.insert(element["id"].get<std::int64_t>());
    for (const Json& element : elements.items()) {
      const Json& type = element["type"];
      if (type == "node") add_node(element);
      if (type == "way") add_way(element["id"].get<std::int64_t>(), element);
      if (type == "relation") add_relation(element);
    }
    return "<osm version=\"0.6\">\n" + xml_ + "</osm>\n";
  }
  [[nodiscard]] std::size_t osm_ways_without_nodes() const { return without_nodes_; }

 private:
  void add_tags(const Json& element) {
    if (!element["tags"].is_object()) return;
    for (const auto& [key, value] : element["tags"].members()) {
      xml_ += fmt::format("<tag k=\"{}\" v=\"{}\"/>", xml_escaped(key),
                          xml_escaped(value.is_string() ? value.text() : value.dump()));
    }
  }
  void open(const char* kind, std::int64_t id, const Json& element) {
    const Json& version = element["version"];
    xml_ += fmt::format("<{} id=\"{}\" version=\"{}\"", kind, id,
                        version.is_integer() ? version.get<std::int64_t>() : 1);
    if (element["visible"] == false) xml_ += " visible=\"false\"";
  }
  void add_node(const Json& node) {
    open("node", node["id"].get<std::int64_t>(), node);
    xml_ +=
        fmt::format(" lat=\"{:.9f}\" lon=\"{:.9f}\">", node["lat"].get<double>(), node["lon"].get<double>());
    add_tags(node);
    xml_ += "</node>\n";
  }
  static constexpr std::int64_t kNowhere = -1'000'000'000'000;  ///< the id of a missing node
  /// The id of a node of a geometry without ids.
  std::int64_t id_at(double lat, double lon) {
    const auto next = kNowhere - 1 - static_cast<std::int64_t>(ids_.size());
    return ids_.try_emplace({lat, lon}, next).first->second;
  }
  void add_way(std::int64_t id, const Json& route) {
    const Json& nodes = route["nodes"];
    const Json& geometry = route["geometry"];
    open("way", id, route);
    xml_ += ">";
    const bool listed = nodes.is_array();
    const std::size_t count = listed ? nodes.size() : geometry.is_array() ? geometry.size() : 0;
    if (listed && geometry.is_array() && geometry.size() != count)
      throw JsonError(fmt::format("way {} has {} nodes and {} positions", id, count, geometry.size()));
    if (count == 0) ++without_nodes_;
    for (std::size_t i = 0; i < count; ++i) {
      // Null: a node outside the requested box. Its way refers to a node that is not in the data.
      const bool is_located = geometry.is_array() && i < geometry.size() && geometry[i].is_object();
      const double lat = is_located ? geometry[i]["lat"].get<double>() : 0;
      const double lon = is_located ? geometry[i]["lon"].get<double>() : 0;
      const std::int64_t unlisted = is_located ? id_at(lat, lon) : kNowhere;
      xml_ += fmt::format("<nd ref=\"{}\"", listed ? nodes[i].get<std::int64_t>() : unlisted);
      if (is_located) xml_ += fmt::format(" lat=\"{:.9f}\" lon=\"{:.9f}\"", lat, lon);
      xml_ += "/>";
    }
    add_tags(route);
    xml_ += "</way>\n";
  }
  void add_relation(const Json& relation) {
    std::string members;
    for (const Json& member : relation["members"].is_array() ? relation["members"].items() : Json::Array{}) {
      const auto ref = member["ref"].get<std::int64_t>();
      const std::string type = member["type"].is_string() ? member["type"].text() : "";
      if (type == "way" && member["geometry"].is_array() && ways_.insert(ref).second) add_way(ref, member);
      members += fmt::format("<member type=\"{}\" ref=\"{}\" role=\"{}\"/>", xml_escaped(type), ref,
                             xml_escaped(member["role"].is_string() ? member["role"].text() : ""));
    }
    open("relation", relation["id"].get<std::int64_t>(), relation);
    xml_ += ">" + members;
    add_tags(relation);
    xml_ += "</relation>\n";
  }

  std::string xml_;
  std::set<std::int64_t> ways_;
  std::map<std::pair<double, double>, std::int64_t> ids_;
  std::size_t without_nodes_ = 0;
};

/// OSM XML with only the attributes needed for buildings. Users, change sets and times are dropped, because
/// libosmium rejects files by them (user ids above 31 bits). An object marked by JOSM with action='delete'
/// becomes visible='false' (OSM wiki, JOSM file format). Lines keep their numbers. Text that is not XML is
/// returned unchanged.
std::string plain_osm_xml(std::string_view xml) {
  std::string plain;
  plain.reserve(xml.size());
  std::size_t at = 0;
  while (at < xml.size()) {
    const std::size_t open = std::min(xml.find('<', at), xml.size());
    plain += xml.substr(at, open - at);
    at = open;
    if (xml.substr(at, 4) == "<!--") {
      const std::size_t end = xml.find("-->", at);
      const std::size_t after = end == std::string_view::npos ? xml.size() : end + 3;
      plain += xml.substr(at, after - at);
      at = after;
      continue;
    }
    const std::string_view tag = xml.substr(at, xml.find_first_of(" \t\r\n/>", at + 1) - at);
    plain += tag;
    at += tag.size();
    if (tag != "<node" && tag != "<way" && tag != "<relation") {
      if (tag.empty() && at < xml.size()) plain += xml[at++];
      continue;
    }
    bool deleted = false;
    std::string_view visible;
    while (const auto attribute = take_attribute(xml, at)) {
      const std::string_view name = attribute->name;
      if (name == "action") deleted = attribute->value == "delete";
      if (name == "visible") visible = attribute->text;
      if (name == "id" || name == "version" || name == "lat" || name == "lon") {
        plain += attribute->text;
      } else {
        plain.append(
            static_cast<std::size_t>(std::count(attribute->text.begin(), attribute->text.end(), '\n')), '\n');
      }
    }
    if (deleted)
      plain += " visible='false'";
    else
      plain += visible;
  }
  return plain;
}

/// Converts Overpass JSON (`out body` with nodes, or `out geom`) to OSM XML. Ways without node ids get new
/// ids, and members of relations with a geometry become ways. Throws InputError if the text is not Overpass
/// JSON, if the server aborted (`remark`), and if ways have no geometry.
std::string osm_xml_from_overpass(const std::filesystem::path& path, std::string_view json) {
  try {
    const Json root = Json::parse(json);
    if (root["remark"].is_string() && root["remark"].text().find("error") != std::string::npos) {
      throw InputError(path, 0, fmt::format("Overpass aborted: {}", root["remark"].text()),
                       "fetch it again with more time, or in smaller pieces");
    }
    if (!root["elements"].is_array()) {
      throw InputError(path, 0, "is JSON, but neither CityJSON nor Overpass's (no \"elements\")",
                       "give a map as .osm, .osm.pbf, Overpass JSON or CityJSON");
    }
    OverpassXml xml;
    std::string text = xml.take(root["elements"]);
    if (xml.osm_ways_without_nodes() > 0) {
      throw InputError(path, 0,
                       fmt::format("{} ways have neither nodes nor geometry", xml.osm_ways_without_nodes()),
                       "query Overpass with 'out geom', or 'out body; >; out skel'");
    }
    return text;
  } catch (const JsonError& e) {
    throw InputError(path, 0, fmt::format("is not Overpass JSON ({})", e.what()), "fetch it again");
  }
}

/// Larger files are passed to libosmium unchanged, in pieces: editors do not save larger maps.
constexpr std::uintmax_t kMaxEdited = std::uintmax_t{1} << 26;

/// Throws osmium::pbf_error for a blob without a type: libosmium would compare a null pointer.
void check_blob_types(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::array<unsigned char, 4> length{};
  std::string header;
  while (in.read(reinterpret_cast<char*>(length.data()), length.size())) {
    const std::uint32_t size = std::uint32_t{length[0]} << 24 | std::uint32_t{length[1]} << 16 |
                               std::uint32_t{length[2]} << 8 | length[3];
    if (size > static_cast<std::uint32_t>(osmium::io::detail::max_blob_header_size))
      return;  // libosmium reports it
    header.resize(size);
    if (!in.read(header.data(), size)) return;
    constexpr int kType = 1, kDataSize = 3;  // fileformat.proto
    bool typed = false;
    std::int32_t data_size = 0;
    for (protozero::pbf_reader blob(header); blob.next();)
      if (blob.tag() == kType && blob.wire_type() == protozero::pbf_wire_type::length_delimited)
        typed = blob.get_view().size() > 0;
      else if (blob.tag() == kDataSize && blob.wire_type() == protozero::pbf_wire_type::varint)
        data_size = blob.get_int32();
      else
        blob.skip();
    if (!typed) throw osmium::pbf_error("a blob has no type");
    if (data_size < 0) return;
    in.seekg(data_size, std::ios::cur);
  }
}

/// Throws osmium::pbf_error for tags that contain a zero byte: libosmium would read beyond the list.
void check_tags(const osmium::TagList& tags) {
  const auto* const bytes = reinterpret_cast<const unsigned char*>(&tags);
  const unsigned char* const begin = bytes + sizeof(osmium::TagList);
  const unsigned char* const end = bytes + tags.byte_size();
  if (begin == end) return;
  if (end[-1] != 0 || std::count(begin, end, 0) % 2 != 0) throw osmium::pbf_error("a tag has a zero byte");
}

/// Changes an object's ids and references to those of the n-th file, as described at OsmId.
void number_by_file(osmium::OSMObject& object, OsmId n) {
  if (n == 0) return;
  const auto own = [n](OsmId id) { return id < 0 && id > -kGeneratedIds ? id - n * kGeneratedIds : id; };
  object.set_id(own(object.id()));
  if (object.type() == osmium::item_type::way)
    for (osmium::NodeRef& node : static_cast<osmium::Way&>(object).nodes()) node.set_ref(own(node.ref()));
  if (object.type() == osmium::item_type::relation)
    for (osmium::RelationMember& member : static_cast<osmium::Relation&>(object).members())
      member.set_ref(own(member.ref()));
}

}  // namespace

OsmFile open_osm_file(const std::filesystem::path& path) {
  check_input_file(path);
  const std::string head = read_head(path, 64);
  if (head.empty()) throw InputError(path, 0, "is empty or cannot be read", "fetch the map again");
  // A PBF file begins with the length of a BlobHeader of type "OSMHeader".
  if (head[0] == '\0' && head.find("OSMHeader") != std::string::npos) return {path, "pbf", {}};
  if (std::filesystem::file_size(path) > kMaxEdited)
    return {path, is_gzip(head) ? "osm.gz" : is_bzip2(head) ? "osm.bz2" : "osm", {}};
  const TextFile file(path);
  const std::string_view text = trim(file.text());
  if (text.starts_with('{')) return {path, "osm", osm_xml_from_overpass(path, text)};
  if (!text.starts_with('<')) {
    throw InputError(path, 0, "is not an OpenStreetMap file",
                     "give an extract as .osm, .osm.gz, .osm.bz2, .osm.pbf or Overpass JSON");
  }
  // Overpass writes a remark after the data if it could not finish.
  const std::size_t remark = text.rfind("<remark>");
  if (remark != std::string_view::npos && text.find("runtime error", remark) != std::string_view::npos) {
    throw InputError(path, 0, "Overpass aborted: a part of the map is missing",
                     "fetch it again with more time, or in smaller pieces");
  }
  return {path, "osm", plain_osm_xml(file.text())};
}

void for_each_object(const std::vector<OsmFile>& files, osmium::osm_entity_bits::type bits,
                     const UseOsmObject& use) {
  for (const OsmFile& source : files) {
    const std::filesystem::path& path = source.path;
    try {
      if (source.format == "pbf") check_blob_types(path);
      // An absolute path, because libosmium interprets "-" and "http:".
      const osmium::io::File file =
          source.text ? osmium::io::File{source.text->data(), source.text->size(), source.format}
                      : osmium::io::File{std::filesystem::absolute(path).string(), source.format};
      osmium::io::Reader reader{file, bits};
      while (osmium::memory::Buffer buffer = reader.read()) {
        for (auto& object : buffer.select<osmium::OSMObject>()) {
          check_tags(object.tags());
          number_by_file(object, &source - files.data());
          use(object);
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
                       "fetch a new extract in version 0.6");
    } catch (const osmium::invalid_location& error) {
      throw InputError(
          path, 0,
          fmt::format("has a coordinate that is not a number or not on the Earth ({})", error.what()));
    } catch (const std::exception& error) {
      const std::string_view what = error.what();
      // Compressions and features of PBF not supported by libosmium.
      if (what.find("not supported") != std::string_view::npos ||
          what.find("unknown compression") != std::string_view::npos) {
        throw InputError(path, 0, fmt::format("is an unsupported variant ({})", what),
                         "convert it to PBF with zlib, e.g. with osmium cat -f pbf -o NEW.osm.pbf");
      }
      throw InputError(path, 0, fmt::format("is cut short or damaged ({})", error.what()), "fetch it again");
    }
  }
}

}  // namespace canyon::buildings
