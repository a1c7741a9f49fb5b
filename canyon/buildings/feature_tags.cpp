// Declared in canyon/buildings/builder_steps.hpp.
#include "canyon/buildings/builder_steps.hpp"

#include <algorithm>

#include "canyon/city/city.hpp"

namespace canyon::buildings {
namespace {

constexpr auto kHeightKeys = {"height", "building:height", "est_height", "building:levels"};
constexpr auto kFacadeKeys = {"building:facade:material", "facade:material", "building:material",
                              "building:cladding"};
constexpr auto kUseKeys = {"building", "building:structure", "start_date"};
constexpr auto kRoofKeys = {"roof:material", "building:roof:material"};

bool has_any(const TagMap& tags, std::initializer_list<const char*> keys) {
  return std::any_of(keys.begin(), keys.end(), [&tags](const char* key) { return tags.count(key) > 0; });
}

/// Takes all of these where there is none of them.
void inherit(TagMap& tags, const TagMap& from, std::initializer_list<const char*> keys) {
  if (has_any(tags, keys)) return;
  for (const char* key : keys) {
    const auto found = from.find(key);
    if (found != from.end()) tags.insert(*found);
  }
}

}  // namespace

bool is_facade_known(const TagMap& tags) {
  return std::any_of(kFacadeKeys.begin(), kFacadeKeys.end(), [&tags](const char* key) {
    const auto found = tags.find(key);
    return found != tags.end() && material_from_tag(found->second) != city::Material::Unknown;
  });
}

double length_tag_m(const TagMap& tags, const char* key, double low, double high, double otherwise) {
  const auto found = tags.find(key);
  if (found == tags.end()) return otherwise;
  const std::optional<double> value = parse_length_m(found->second);
  return value && *value >= low && *value <= high ? *value : otherwise;
}

TagMap FeatureTags::of(std::size_t feature, bool* inherited) const {
  TagMap tags = map_.features[feature].tags;
  if (!building_[feature]) return tags;
  const TagMap& from = map_.features[*building_[feature]].tags;
  const bool own_height = has_any(tags, kHeightKeys);
  inherit(tags, from, kHeightKeys);
  inherit(tags, from, kFacadeKeys);
  inherit(tags, from, kRoofKeys);
  if (inherited != nullptr) *inherited = !own_height && has_any(tags, kHeightKeys);
  return tags;
}

Shape FeatureTags::shape(std::size_t feature) const {
  std::vector<std::string> ignored;
  return shape_from_tags(of(feature), heights_, map_.features[feature].id, ignored);
}

city::FacadeMix FeatureTags::facades(std::size_t feature) const {
  TagMap tags = map_.features[feature].tags;
  if (building_[feature]) {
    for (const char* key : kUseKeys) inherit(tags, map_.features[*building_[feature]].tags, {key});
  }
  return facades_from_tags(tags);
}

}  // namespace canyon::buildings
