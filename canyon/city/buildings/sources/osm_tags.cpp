// Declared in canyon/city/buildings/sources/osm_objects.hpp.
#include "canyon/city/buildings/sources/osm_objects.hpp"

#include <fmt/chrono.h>

#include <algorithm>
#include <array>
#include <ctime>

#include "canyon/base/text.hpp"
#include "canyon/city/buildings/sources/shape.hpp"

namespace canyon::buildings {
namespace {

// Prefixes of things that are gone or not there yet (OSM wiki, "Lifecycle prefix").
constexpr std::array<std::string_view, 12> kLifecyclePrefixes{
    "demolished", "razed",    "removed", "destroyed",    "abandoned", "was",
    "dismantled", "proposed", "planned", "construction", "historic",  "ruined"};
// Values of the key "building", and keys of their own ("demolished=2019").
constexpr std::array<std::string_view, 6> kGoneValues{"demolished", "razed",      "removed",
                                                      "destroyed",  "dismantled", "collapsed"};
constexpr std::array<std::string_view, 3> kNotThereValues{"proposed", "planned", "was"};
// Only a stated height of these is known.
constexpr std::array<std::string_view, 4> kUnfinishedValues{"construction", "ruins", "ruin", "foundation"};

// Values of "man_made" that are as high as buildings, and mapped without that key.
constexpr std::array<std::string_view, 7> kStructures{"silo",    "storage_tank",  "water_tower", "gasometer",
                                                      "chimney", "cooling_tower", "tower"};

/// A building that nobody uses stands (OSM wiki, "Key:disused:*").
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

/// Whether "-1", "-2;-1" and "-2--1" lists storeys, and none above the ground.
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

bool underground(const TagMap& tags) {
  const std::string_view location = tag(tags, "location");
  if (location == "underground" || location == "below_ground" || location == "subsurface") return true;
  if (tag(tags, "parking") == "underground" || tag(tags, "underground") == "yes") return true;
  const bool above = positive(tag(tags, "height")) || positive(tag(tags, "building:levels"));
  if (above) return false;
  const std::optional<double> layer = parse_double(tag(tags, "layer"));
  if (layer && *layer < 0) return true;
  for (const char* key : {"level", "max_level", "building:levels"})
    if (all_below_ground(tag(tags, key))) return true;
  const std::optional<double> levels = parse_double(tag(tags, "building:levels"));
  return levels && *levels == 0 && positive(tag(tags, "building:levels:underground")) &&
         !positive(tag(tags, "roof:levels"));
}

/// Whether a date with a year of four digits ("2031", "2031-05", "~2031", "2030s", "31.12.2031"; OSM wiki,
/// "Key:start_date") is later than today (UTC); "before 2031" may be any day.
bool lies_ahead(std::string_view date) {
  const std::string today = fmt::format("{:%Y-%m-%d}", fmt::gmtime(std::time(nullptr)));
  constexpr std::string_view kDigits = "0123456789";
  for (std::size_t at = 0; (at = date.find_first_of(kDigits, at)) != std::string_view::npos;) {
    const std::size_t end = std::min(date.find_first_not_of(kDigits, at), date.size());
    if (end - at == 4) return date.substr(at) > today && !date.starts_with("before");
    at = end;
  }
  return false;
}

/// A road or railway under a roof or on a bridge. Passages through buildings are in these already.
bool is_passage(const TagMap& tags) {
  if (tag(tags, "highway").empty() && tag(tags, "railway").empty()) return false;
  const auto says = [&](const char* key) {
    const std::string_view value = tag(tags, key);
    return !value.empty() && !is_no(value) && value != "building_passage";
  };
  return says("tunnel") || says("covered") || says("bridge");
}

std::string reason_to_leave_out(const TagMap& tags, std::string_view value) {
  const auto says = [&](const auto& words, const auto& of_own) {
    return std::any_of(words.begin(), words.end(), [&](std::string_view word) {
      return value == word || of_own(tag(tags, std::string(word).c_str()));
    });
  };
  if (says(kGoneValues, [](std::string_view own) { return !own.empty() && !is_no(own); }) ||
      says(kNotThereValues, [](std::string_view own) { return own == "yes"; }))
    return "demolished or not built";
  const bool unfinished =
      std::find(kUnfinishedValues.begin(), kUnfinishedValues.end(), value) != kUnfinishedValues.end();
  if (unfinished && !positive(tag(tags, "height")) && !positive(tag(tags, "building:levels")))
    return "in ruins or under construction, without a height";
  const std::string_view end = tag(tags, "end_date");
  if (!end.empty() && !lies_ahead(end)) return "with an end_date";
  const std::string_view indoor = tag(tags, "indoor");
  if ((!indoor.empty() && indoor != "no") || tag(tags, "location") == "indoor") return "indoor";
  if (underground(tags)) return "underground";
  return {};
}

}  // namespace

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
  if (!building.empty() && !is_no(building)) {
    return {FeatureKind::Building, reason_to_leave_out(tags, building)};
  }
  if (!part.empty() && !is_no(part)) return {FeatureKind::Part, reason_to_leave_out(tags, part)};
  for (const auto& [key, value] : tags) {
    if (!lifecycle_prefix(key).empty() && !is_no(trim(value))) {
      return {FeatureKind::Building, "demolished or not built"};
    }
  }
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

bool says_nothing(const TagMap& tags) {
  static constexpr std::array<std::string_view, 7> kSilent{"type",    "source", "created_by", "note",
                                                           "comment", "fixme",  "FIXME"};
  return std::all_of(tags.begin(), tags.end(), [](const auto& tag) {
    return std::find(kSilent.begin(), kSilent.end(), tag.first) != kSilent.end();
  });
}

}  // namespace canyon::buildings
