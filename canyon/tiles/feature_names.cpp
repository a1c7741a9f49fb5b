// Declared in canyon/tiles/tile_content.hpp.
#include "canyon/tiles/tile_content.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "canyon/base/text.hpp"
#include "canyon/city/mesh_marks.hpp"

namespace canyon::tiles {
namespace {

constexpr std::size_t kLongestFeatureName = 120;

/// The first column that one of the words names, in upper or lower case; empty for none.
template <std::size_t N>
std::vector<std::string> first_of(const std::array<std::string_view, N>& words, const TextColumns& columns) {
  for (const std::string_view word : words) {
    for (const auto& [name, texts] : columns)
      if (lower_case(name) == word) return texts;
  }
  return {};
}

std::string feature_text(const Json& value) {
  if (value.is_string()) return value.text().substr(0, kLongestFeatureName);
  return value.is_number() ? value.dump() : std::string();
}

std::vector<std::string> texts_of(const Json& list) {
  std::vector<std::string> texts;
  for (const Json& item : list) texts.push_back(feature_text(item));
  return texts;
}

/// The name of the class of each instance of a batch table with a hierarchy.
std::vector<std::string> hierarchy_kinds(const Json& hierarchy) {
  std::vector<std::string> kinds;
  const Json* classes = hierarchy.find("classes");
  const Json* ids = hierarchy.find("classIds");
  if (classes == nullptr || ids == nullptr || !classes->is_array() || !ids->is_array()) return kinds;
  for (const Json& id : *ids) {
    const bool known =
        id.is_integer() && id.get<double>() >= 0 && id.get<double>() < static_cast<double>(classes->size());
    kinds.push_back(known ? feature_text((*classes)[static_cast<std::size_t>(id.get<double>())]["name"])
                          : std::string());
  }
  return kinds;
}

}  // namespace

FeatureNames feature_names(const TextColumns& columns) {
  static constexpr std::array<std::string_view, 9> kNames{"name",   "gml:name",  "gml_id", "gml:id", "gmlid",
                                                          "osm_id", "elementid", "id",     "uuid"};
  static constexpr std::array<std::string_view, 10> kKinds{
      "class",     "feature_type", "_feature_type", "featuretype", "feature:type",
      "classname", "objecttype",   "type",          "category",    "layer"};
  return {first_of(kNames, columns), first_of(kKinds, columns)};
}

FeatureNames batch_names(const Json& table) {
  if (!table.is_object()) return {};
  TextColumns columns;
  for (const Json::Member& member : table.members())
    if (member.value.is_array()) columns[member.key] = texts_of(member.value);
  FeatureNames names = feature_names(columns);
  const Json& in_extensions = table["extensions"]["3DTILES_batch_table_hierarchy"];
  const Json& hierarchy = in_extensions.is_object() ? in_extensions : table["HIERARCHY"];
  if (names.kind.empty() && hierarchy.is_object()) names.kind = hierarchy_kinds(hierarchy);
  return names;
}

std::optional<city::Surface> surface_by_word(std::string_view text) {
  using city::Surface;
  static constexpr std::pair<std::string_view, Surface> kWords[]{
      {"building", Surface::Building}, {"buildings", Surface::Building},    {"bldg", Surface::Building},
      {"roof", Surface::Building},     {"wall", Surface::Building},         {"bridge", Surface::Building},
      {"tree", Surface::Foliage},      {"trees", Surface::Foliage},         {"vegetation", Surface::Foliage},
      {"foliage", Surface::Foliage},   {"plant", Surface::Foliage},         {"forest", Surface::Foliage},
      {"terrain", Surface::Terrain},   {"ground", Surface::Terrain},        {"dem", Surface::Terrain},
      {"dtm", Surface::Terrain},       {"relief", Surface::Terrain},        {"tinrelief", Surface::Terrain},
      {"road", Surface::Terrain},      {"street", Surface::Terrain},        {"railway", Surface::Terrain},
      {"water", Surface::Terrain},     {"waterbody", Surface::Terrain},     {"landuse", Surface::Terrain},
      {"vehicle", Surface::Vehicle},   {"transportation", Surface::Terrain}};
  for (const auto& [word, surface] : kWords) {
    if (city::has_word(text, word)) return surface;
  }
  return std::nullopt;
}

}  // namespace canyon::tiles
