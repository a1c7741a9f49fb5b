#include "canyon/buildings/sources/osm_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/utf8.hpp"

namespace canyon::buildings {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

/// One attribute with the blanks before it.
struct Attribute {
  std::string_view text, name, value;
};

/// The attribute at `at`, which moves behind it; nothing at the end of a tag and in text that is not XML.
std::optional<Attribute> take_attribute(std::string_view xml, std::size_t& at) {
  const std::size_t begin = xml.find_first_not_of(kBlanks, at);
  const std::size_t equals = xml.find('=', at);
  if (begin == std::string_view::npos || equals == std::string_view::npos || xml[begin] == '>' ||
      xml[begin] == '/') {
    return std::nullopt;
  }
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
      check_members(element);
      if (type == "node") add_node(element);
      if (type == "way") add_way(element["id"].get<std::int64_t>(), element);
      if (type == "relation") add_relation(element);
    }
    return "<osm version=\"0.6\">\n" + xml_ + "</osm>\n";
  }
  [[nodiscard]] std::size_t ways_without_nodes() const { return without_nodes_; }

 private:
  /// Throws JsonError for an element of no type that Overpass has, and for members that stand for others.
  static void check_members(const Json& element) {
    static const std::vector<std::string> kTypes{"node", "way", "relation", "area", "count", "timeline"};
    static const std::vector<std::string> kMembers{"type",    "id",       "tags", "nodes",
                                                   "members", "geometry", "lat",  "lon"};
    const std::string type = element["type"].is_string() ? element["type"].text() : "";
    if (std::find(kTypes.begin(), kTypes.end(), type) == kTypes.end())
      throw JsonError(fmt::format("an element is of type '{}'", type));
    for (const auto& [key, value] : element.members()) {
      const bool known = std::find(kMembers.begin(), kMembers.end(), key) != kMembers.end();
      const auto meant = known || key.size() < 3 ? std::nullopt : closest(key, kMembers);
      if (meant && !element.contains(*meant))
        throw JsonError(fmt::format("an element has no '{}', but '{}'", *meant, key));
    }
  }
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
  static constexpr std::int64_t kNowhere = -1'000'000'000'000;  ///< the id of a node that is not there
  /// The id of a node of a geometry without ids.
  std::int64_t id_at(double lat, double lon) {
    const auto next = kNowhere - 1 - static_cast<std::int64_t>(ids_.size());
    return ids_.try_emplace({lat, lon}, next).first->second;
  }
  void add_way(std::int64_t id, const Json& way) {
    const Json& nodes = way["nodes"];
    const Json& geometry = way["geometry"];
    open("way", id, way);
    xml_ += ">";
    const bool listed = nodes.is_array();
    const std::size_t count = listed ? nodes.size() : geometry.is_array() ? geometry.size() : 0;
    if (listed && geometry.is_array() && geometry.size() != count)
      throw JsonError(fmt::format("way {} has {} nodes and {} places", id, count, geometry.size()));
    if (count == 0) ++without_nodes_;
    for (std::size_t i = 0; i < count; ++i) {
      // Null: a node outside the box that was asked for. Its way names a node that is not there.
      const bool placed = geometry.is_array() && i < geometry.size() && geometry[i].is_object();
      const double lat = placed ? geometry[i]["lat"].get<double>() : 0;
      const double lon = placed ? geometry[i]["lon"].get<double>() : 0;
      const std::int64_t unlisted = placed ? id_at(lat, lon) : kNowhere;
      xml_ += fmt::format("<nd ref=\"{}\"", listed ? nodes[i].get<std::int64_t>() : unlisted);
      if (placed) xml_ += fmt::format(" lat=\"{:.9f}\" lon=\"{:.9f}\"", lat, lon);
      xml_ += "/>";
    }
    add_tags(way);
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

}  // namespace

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
      const std::size_t behind = end == std::string_view::npos ? xml.size() : end + 3;
      plain += xml.substr(at, behind - at);
      at = behind;
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
    if (deleted) {
      plain += " visible='false'";
    } else {
      plain += visible;
    }
  }
  return plain;
}

bool needs_plain_xml(std::string_view xml) {
  const auto any = [xml](std::string_view name, const auto& is_odd) {
    for (std::size_t at = xml.find(name); at != std::string_view::npos; at = xml.find(name, at + 1)) {
      const std::string_view rest = xml.substr(at + name.size());
      if (rest.empty() || is_odd(rest.substr(1, rest.find(rest.front(), 1) - 1))) return true;
    }
    return false;
  };
  // 2^31 has ten digits.
  const auto is_long = [](std::string_view number) { return number.size() > 9; };
  const auto is_no_time = [](std::string_view time) { return time.size() != 20 || time.back() != 'Z'; };
  return xml.find(" action=") != std::string_view::npos || any(" uid=", is_long) ||
         any(" changeset=", is_long) || any(" timestamp=", is_no_time);
}

std::string osm_xml_from_overpass(const std::filesystem::path& path, std::string_view json) {
  try {
    const Json root = Json::parse(json);
    if (root["remark"].is_string() && root["remark"].text().find("error") != std::string::npos) {
      throw InputError(path, 0, fmt::format("Overpass gave up: {}", root["remark"].text()),
                       "fetch it again with more time, or in smaller pieces");
    }
    if (!root["elements"].is_array()) {
      throw InputError(path, 0, "is JSON, but neither CityJSON nor Overpass's (no \"elements\")",
                       "give a map as .osm, .osm.pbf, Overpass JSON or CityJSON");
    }
    OverpassXml xml;
    std::string text = xml.take(root["elements"]);
    if (xml.ways_without_nodes() > 0) {
      throw InputError(path, 0,
                       fmt::format("{} ways have neither nodes nor geometry", xml.ways_without_nodes()),
                       "ask Overpass with 'out geom', or 'out body; >; out skel'");
    }
    return text;
  } catch (const JsonError& e) {
    throw InputError(path, 0, fmt::format("is not Overpass JSON ({})", e.what()), "fetch it again");
  }
}

}  // namespace canyon::buildings
