#include "canyon/city/buildings/sources/city_attributes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "canyon/base/named.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"

namespace canyon::buildings {
namespace {

/// Names of CityGML's and CityJSON's attributes and of common exports, beside the tags that Canyon reads.
constexpr std::array<std::pair<std::string_view, std::string_view>, 14> kSameAs{
    {{"measuredHeight", "height"},
     {"averageHeight", "height"},
     {"storeysAboveGround", "building:levels"},
     {"material", "building:material"},
     {"buildingMaterial", "building:material"},
     {"facadeMaterial", "building:material"},
     {"wallMaterial", "building:material"},
     {"roofMaterial", "roof:material"},
     {"roof_material", "roof:material"},
     {"yearOfConstruction", "start_date"},
     {"dateOfConstruction", "start_date"},
     {"oorspronkelijkbouwjaar", "start_date"},
     {"crownDiameter", "diameter_crown"},
     {"trunkDiameter", "diameter"}}};

/// Further attributes that are read.
constexpr std::array<std::string_view, 10> kOthers{{"function", "usage", "class", "buildingStructureType",
                                                    "height", "species", "yearOfDemolition",
                                                    "dateOfDemolition", "terminationDate", "status"}};

/// The Dutch register of buildings: torn down, not built, and permitted but not begun.
constexpr std::array<std::string_view, 4> kGoneStatus{
    {"Pand gesloopt", "Niet gerealiseerd pand", "Bouwvergunning verleend", "Pand ten onrechte opgevoerd"}};

/// AdV's functions of buildings (31001 in ALKIS' list of kinds of objects) as values of OSM's `building`.
const auto kAdvUses = dictionary<std::string_view>({{"1000|1100|1110|1120|1123", "residential"},
                                                    {"1010", "house"},
                                                    {"1020|1021|1022|1023|1024", "residential"},
                                                    {"2000|2010|2050|2054|2055|2056", "commercial"},
                                                    {"2020|2030", "office"},
                                                    {"2051|2052", "retail"},
                                                    {"2070|2071|2072", "hotel"},
                                                    {"2100|2110|2111|2112|2120", "industrial"},
                                                    {"2140|2143", "warehouse"},
                                                    {"2460|2461", "parking"},
                                                    {"2463", "garage"},
                                                    {"2720", "farm"},
                                                    {"2721", "barn"},
                                                    {"2724", "stable"},
                                                    {"2740|2741", "greenhouse"},
                                                    {"3010|3012|3013|3015", "office"},
                                                    {"3020|3021", "school"},
                                                    {"3023", "university"},
                                                    {"3041|3042", "church"},
                                                    {"3043", "chapel"},
                                                    {"3050|3051", "hospital"}});

/// PLATEAU's codes of usage.
const auto kPlateauUses = dictionary<std::string_view>({{"401|421", "office"},
                                                        {"402|404", "commercial"},
                                                        {"403", "hotel"},
                                                        {"411|413|415", "house"},
                                                        {"412|414", "apartments"},
                                                        {"422", "school"},
                                                        {"431", "warehouse"},
                                                        {"441|452", "industrial"},
                                                        {"451", "farm"}});

/// PLATEAU's codes of structure. 610 (not wood) and 611 (not known) say nothing.
const auto kPlateauStructures = dictionary<std::string_view>(
    {{"601", "wood"}, {"602|603", "concrete"}, {"604|605", "steel"}, {"606", "masonry"}});

std::string_view value_of(const CityAttributes& attributes, const std::string& name) {
  const auto found = attributes.find(name);
  return found == attributes.end() ? std::string_view() : trim(found->second);
}

bool is_word(std::string_view text) {
  constexpr std::size_t kLongest = 32;
  return text.size() <= kLongest && std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
         });
}

/// The value of `building` that one code or word stands for; empty where it is not known.
std::string use_of(std::string_view value) {
  // "31001_2020", "2020", "411"
  const std::string_view code = value.substr(value.find_last_of("_:") + 1);  // all of it without a mark
  const bool digits =
      !code.empty() && std::all_of(code.begin(), code.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!digits) return is_word(value) ? lower_case(value) : std::string();
  if (code.size() != 3 && code.size() != 4) return {};
  const auto& uses = code.size() == 4 ? kAdvUses : kPlateauUses;
  const auto found = uses.find(code);
  return found == uses.end() ? std::string() : std::string(found->second);
}

/// Whether an attribute's value stands for one that is not known, or cannot be.
bool is_filler(std::string_view tag, std::string_view value) {
  const std::optional<double> number = parse_double(value);
  if (tag == "height") return number && (*number <= 0 || *number >= 2000);
  if (tag == "building:levels") return number && (*number <= 0 || *number > 300);
  if (tag == "start_date") {
    const std::optional<double> year = parse_double(value.substr(0, 4));
    return !year || *year < 1000 || *year > 2200;
  }
  return value.empty();
}

}  // namespace

bool attribute_matters(std::string_view name) {
  return std::any_of(kSameAs.begin(), kSameAs.end(),
                     [name](const auto& pair) { return pair.first == name; }) ||
         std::find(kOthers.begin(), kOthers.end(), name) != kOthers.end();
}

std::optional<std::string> value_in_metres(std::string_view name, std::string_view value,
                                           std::string_view unit) {
  const auto same =
      std::find_if(kSameAs.begin(), kSameAs.end(), [name](const auto& pair) { return pair.first == name; });
  const std::string_view tag = same == kSameAs.end() ? name : same->second;
  unit = trim(unit);
  if (unit.empty() || (tag != "height" && tag != "diameter_crown" && tag != "diameter"))
    return std::string(value);
  const auto metres = metres_of_unit(lower_case(unit.substr(unit.find_last_of("#:/") + 1)));
  if (!metres) return std::nullopt;
  const std::optional<double> number = parse_double(value);
  if (!number || *metres == 1) return std::string(value);
  return fmt::format("{:.10g}", *number * *metres);
}

void add_tags_of_attributes(CityAttributes& tags) {
  for (const auto& [from, to] : kSameAs) {
    const std::string_view value = value_of(tags, std::string(from));
    if (!value.empty() && !is_filler(to, value)) tags.emplace(to, value);
  }
  const auto structure = kPlateauStructures.find(value_of(tags, "buildingStructureType"));
  if (structure == kPlateauStructures.end()) return;
  tags.emplace("building:structure", structure->second);
  // Frames of concrete and steel carry facades of any material.
  if (structure->second == "wood") tags.emplace("building:material", "wood");
  if (structure->second == "masonry") tags.emplace("building:material", "brick");
}

bool is_gone(const CityAttributes& attributes) {
  for (const char* name : {"yearOfDemolition", "dateOfDemolition", "terminationDate"}) {
    const std::optional<double> year = parse_double(value_of(attributes, name).substr(0, 4));
    constexpr double kFirst = 1000, kLast = 2100;  // 9999 stands for none
    if (year && *year >= kFirst && *year <= kLast) return true;
  }
  return std::find(kGoneStatus.begin(), kGoneStatus.end(), value_of(attributes, "status")) !=
         kGoneStatus.end();
}

std::string building_use(const CityAttributes& attributes) {
  for (const char* name : {"function", "usage", "class"}) {
    std::string use = use_of(value_of(attributes, name));
    if (!use.empty()) return use;
  }
  return "yes";
}

}  // namespace canyon::buildings
