#include "canyon/tiles/feature_names.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "canyon/base/text.hpp"
#include "canyon/city/mesh_names.hpp"

namespace canyon::tiles {
namespace {

constexpr std::size_t kLongestFeatureName = 120;

template <std::size_t N>
std::optional<int> rank_in(const std::array<std::string_view, N>& words, std::string_view property) {
  const std::string lower = lower_case(property);
  const auto found = std::find(words.begin(), words.end(), lower);
  if (found == words.end()) return std::nullopt;
  return static_cast<int>(found - words.begin());
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

std::optional<int> name_rank(std::string_view property) {
  static constexpr std::array<std::string_view, 9> kWords{"name",   "gml:name",  "gml_id", "gml:id", "gmlid",
                                                          "osm_id", "elementid", "id",     "uuid"};
  return rank_in(kWords, property);
}

std::optional<int> kind_rank(std::string_view property) {
  static constexpr std::array<std::string_view, 10> kWords{
      "class",     "feature_type", "_feature_type", "featuretype", "feature:type",
      "classname", "objecttype",   "type",          "category",    "layer"};
  return rank_in(kWords, property);
}

FeatureNames batch_names(const Json& table) {
  FeatureNames names;
  if (!table.is_object()) return names;
  std::optional<int> best_name, best_kind;
  for (const Json::Member& member : table.members()) {
    if (!member.value.is_array()) continue;
    const std::optional<int> as_name = name_rank(member.key), as_kind = kind_rank(member.key);
    if (as_name && (!best_name || *as_name < *best_name)) {
      names.name = texts_of(member.value);
      best_name = as_name;
    }
    if (as_kind && (!best_kind || *as_kind < *best_kind)) {
      names.kind = texts_of(member.value);
      best_kind = as_kind;
    }
  }
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
