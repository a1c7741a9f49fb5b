// Height, roof and material of a building by its tags: OSM wiki, "Simple 3D Buildings".
#include "canyon/buildings/sources/shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "canyon/base/dictionary.hpp"
#include "canyon/base/text.hpp"

namespace canyon::buildings {
namespace {

constexpr double kHighest_m = 2000;          // above it a value is a slip
constexpr double kThinnest_m = 0.1;          // a building lower than this is a slip
constexpr double kMostLevels = 400;          //
constexpr double kSlab_m = 0.3;              // thickness of a roof on pillars
constexpr double kLowestTaggedLevel_m = 2;   // storey heights outside are no sign of how
constexpr double kHighestTaggedLevel_m = 8;  // high the storeys are

constexpr std::array<std::pair<RoofShape, std::string_view>, 10> kRoofNames{
    {{RoofShape::Flat, "flat"},
     {RoofShape::Gabled, "gabled"},
     {RoofShape::Hipped, "hipped"},
     {RoofShape::Pyramidal, "pyramidal"},
     {RoofShape::Skillion, "skillion"},
     {RoofShape::Dome, "dome"},
     {RoofShape::Onion, "onion"},
     {RoofShape::Round, "round"},
     {RoofShape::Gambrel, "gambrel"},
     {RoofShape::Mansard, "mansard"}}};

// Shapes without a form of their own, by the nearest one that has the same eaves and ridge.
const auto kRoofFallbacks = dictionary<RoofShape>(
    {{"gable|pitched|saltbox|double_saltbox|gabled_height_moved|gabled_row|crosspitched|"
      "cross_gabled",
      RoofShape::Gabled},
     {"quadruple_saltbox|hip|half-hipped|half_hipped|side_hipped|side_half-hipped|"
      "hipped-and-gabled",
      RoofShape::Hipped},
     {"pyramid|conical|cone", RoofShape::Pyramidal},
     {"spherical", RoofShape::Dome},
     {"lean_to|mono_pitched", RoofShape::Skillion},
     {"barrel", RoofShape::Round},
     {"terrace", RoofShape::Flat}});

/// A feature's tags, read with complaints.
class Tags {
 public:
  Tags(const std::map<std::string, std::string>& tags, const std::string& id,
       std::vector<std::string>& warnings)
      : tags_(tags), id_(id), warnings_(warnings) {}

  [[nodiscard]] std::string_view text(const char* key) const {
    const auto found = tags_.find(key);
    return found == tags_.end() ? std::string_view() : trim(found->second);
  }
  void warn(std::string_view problem) const { warnings_.push_back(fmt::format("{}: {}", id_, problem)); }

  /// The first of `keys` that holds a length within [lowest, kHighest_m].
  [[nodiscard]] std::optional<double> length_m(std::initializer_list<const char*> keys, double lowest) const {
    for (const char* key : keys) {
      const std::string_view value = text(key);
      if (value.empty()) continue;
      const std::optional<double> length = parse_length_m(value);
      if (length && *length >= lowest && *length <= kHighest_m) return length;
      if (length) {
        warn(fmt::format("{}={} is outside [{}, {}] m; left out", key, shown(value), lowest, kHighest_m));
      } else {
        warn(fmt::format("{}={} is no length; left out", key, shown(value)));
      }
    }
    return {};
  }

  /// A number of storeys, possibly fractional.
  [[nodiscard]] std::optional<double> levels(const char* key) const {
    const std::string_view value = text(key);
    if (value.empty()) return {};
    std::string point(value.substr(0, 64));
    std::replace(point.begin(), point.end(), ',', '.');
    const std::optional<double> count = parse_double(point);
    if (count && *count >= 0 && *count <= kMostLevels) return count;
    warn(fmt::format("{}={} is no number of storeys within [0, {}]; left out", key, shown(value),
                     kMostLevels));
    return {};
  }

  /// A value for a message: short, one line.
  [[nodiscard]] static std::string shown(std::string_view value) {
    std::string out(value.substr(0, 40));
    std::replace_if(
        out.begin(), out.end(), [](unsigned char c) { return c < 0x20; }, ' ');
    return "'" + out + (value.size() > 40 ? "...'" : "'");
  }

 private:
  const std::map<std::string, std::string>& tags_;
  const std::string& id_;
  std::vector<std::string>& warnings_;
};

RoofShape read_roof_shape(const Tags& tags) {
  std::string_view text = tags.text("roof:shape");
  if (text.empty()) text = tags.text("building:roof:shape");
  if (text.empty()) return RoofShape::Flat;
  const std::string word = lower_case(text);
  for (const auto& [shape, shape_name] : kRoofNames) {
    if (word == shape_name) return shape;
  }
  const auto fallback = kRoofFallbacks.find(word);
  if (fallback != kRoofFallbacks.end()) return fallback->second;
  tags.warn(fmt::format("roof:shape={} is not known; built flat", Tags::shown(text)));
  return RoofShape::Flat;
}

city::Material first_material(const Tags& tags, std::initializer_list<const char*> keys) {
  for (const char* key : keys) {
    const city::Material material = material_from_tag(tags.text(key));
    if (material != city::Material::Unknown) return material;
  }
  return city::Material::Concrete;
}

// Commercial buildings only where they are new; see facades_from_tags().
const auto kFacadesOfUses = dictionary<city::FacadeMix>(
    {{"house|detached|semidetached_house|terrace|bungalow|cabin|hut|farm|church|chapel|cathedral|mosque|"
      "temple|shrine|synagogue|monastery|castle|garage|garages|shed|barn|stable",
      city::FacadeMix::Traditional},
     {"office|commercial|hotel|retail|mall", city::FacadeMix::ThermallyEfficient}});

/// "apartments" of building=apartments or building:part=apartments; empty for plain yes.
std::string building_type(const Tags& tags) {
  for (const char* key : {"building", "building:part"}) {
    const std::string_view value = tags.text(key);
    if (!value.empty() && value != "yes" && value != "no") return std::string(value);
  }
  return {};
}

}  // namespace

std::string_view name(RoofShape shape) {
  for (const auto& [value, text] : kRoofNames) {
    if (value == shape) return text;
  }
  return "flat";
}

std::string_view name(HeightSource source) {
  constexpr std::array<std::string_view, 3> kNames{"height", "levels", "default"};
  return kNames[static_cast<std::size_t>(source)];
}

Shape shape_from_tags(const std::map<std::string, std::string>& raw, const HeightDefaults& defaults,
                      const std::string& id, std::vector<std::string>& warnings) {
  const Tags tags(raw, id, warnings);
  const std::string type = building_type(tags);
  Shape shape;
  shape.roof = read_roof_shape(tags);
  const bool pitched = shape.roof != RoofShape::Flat;

  std::optional<double> height = tags.length_m({"height", "building:height", "est_height"}, kThinnest_m);
  const std::optional<double> min_tag = tags.length_m({"min_height", "building:min_height"}, 0);
  double min_height = min_tag.value_or(0);
  bool min_said = min_tag.has_value();
  std::optional<double> levels = tags.levels("building:levels");
  const std::optional<double> min_level = tags.levels("building:min_level");
  double roof_levels = tags.levels("roof:levels").value_or(0);
  std::optional<double> roof_height;
  if (pitched) roof_height = tags.length_m({"roof:height"}, 0);
  if (!pitched && !tags.text("roof:shape").empty()) roof_levels = 0;
  if (height && min_height > *height - kThinnest_m) {
    tags.warn(fmt::format("min_height={} reaches height={}; min_height left out",
                          Tags::shown(tags.text("min_height")), Tags::shown(tags.text("height"))));
    min_height = 0;
    min_said = false;
  }
  // building:levels counts from the ground, those below building:min_level included; some count otherwise.
  if (levels && min_level && *levels > 0 && *levels <= *min_level) {
    tags.warn(fmt::format(
        "building:levels={} does not reach above building:min_level={}; taken as the storeys above it",
        *levels, *min_level));
    *levels += *min_level;
  }

  // Storey height that the tags themselves imply, where both are there.
  double level_m = defaults.level_m;
  if (height && levels && *levels > 0) {
    const double walls_m = *height - roof_height.value_or(0);
    const double implied_m = walls_m / (*levels + (roof_height ? 0 : roof_levels));
    if (implied_m >= kLowestTaggedLevel_m && implied_m <= kHighestTaggedLevel_m) level_m = implied_m;
  }
  if (!min_said && min_level && *min_level > 0) {
    min_height = *min_level * level_m;
    min_said = true;
  }

  // Height of the roof as far as tags say it, before the height is known.
  const double tagged_roof_m = roof_height ? *roof_height : roof_levels * defaults.level_m;
  const bool roof_tagged = roof_height.has_value() || roof_levels > 0;

  if (height) {
    shape.height_m = *height;
    shape.height_source = HeightSource::Tag;
  } else if (levels && *levels + roof_levels > 0) {
    const double walls_m = *levels * defaults.level_m;
    // An unsaid roof stands on the storeys: one storey high, at most half of what is below it.
    const double below_m = walls_m - std::min(walls_m, min_height);
    const double roof_m = roof_tagged || !pitched ? tagged_roof_m : std::min(defaults.level_m, below_m / 2);
    shape.height_m = walls_m + roof_m;
    shape.height_source = HeightSource::Levels;
  }
  if (shape.height_source == HeightSource::Levels && shape.height_m > kHighest_m) {
    tags.warn(fmt::format("storeys and roof add up to {} m; left out", shape.height_m));
    shape.height_source = HeightSource::Default;
  }
  if (shape.height_source == HeightSource::Default) {
    const auto by_type = defaults.by_type.find(type);
    shape.height_m = by_type != defaults.by_type.end() ? by_type->second : defaults.building_m;
    shape.height_source = HeightSource::Default;
  }
  if (min_height > shape.height_m - kThinnest_m) {
    if (height) {  // by building:min_level: the height is the surer one
      tags.warn(fmt::format("building:min_level={} reaches height={}; left out", min_level.value_or(0),
                            Tags::shown(tags.text("height"))));
      min_height = 0;
      min_said = false;
    } else {  // what is known is that something stands above min_height
      shape.height_m = min_height + std::max(defaults.level_m, kThinnest_m);
      shape.height_source = HeightSource::Default;
    }
  }
  shape.min_height_m = min_height;

  if (pitched) {
    const double most_m = shape.height_m - shape.min_height_m;
    const double default_m = std::min(defaults.level_m, most_m / 3);
    std::optional<double> roof_m;
    if (roof_height && *roof_height > most_m * (1 + 1e-9)) {
      tags.warn(fmt::format("roof:height={} is higher than the building's {} m; left out",
                            Tags::shown(tags.text("roof:height")), most_m));
      roof_height.reset();
    }
    if (roof_height && *roof_height > 0) {
      roof_m = roof_height;
      shape.roof_source = HeightSource::Tag;
    } else if (!roof_height && roof_levels > 0) {
      const double wanted_m = roof_levels * (height ? level_m : defaults.level_m);
      if (wanted_m > most_m * (1 + 1e-9)) {
        tags.warn(
            fmt::format("roof:levels={} are higher than the building's {} m; left out", roof_levels, most_m));
      } else {
        roof_m = wanted_m;
        shape.roof_source = HeightSource::Levels;
      }
    } else if (!roof_height && height && levels && *levels > 0) {
      // The roof takes the height that the storeys leave, if that is a plausible share.
      const double left_m = *height - *levels * defaults.level_m;
      if (left_m >= default_m / 2 && left_m <= most_m / 2) {
        roof_m = left_m;
        shape.roof_source = HeightSource::Levels;
      }
    }
    if (roof_height && *roof_height == 0) {
      shape.roof = RoofShape::Flat;  // roof:height=0 says so
      shape.roof_source = HeightSource::Tag;
    } else {
      if (!roof_m) shape.roof_source = HeightSource::Default;
      shape.roof_height_m = std::min(roof_m.value_or(default_m), most_m);
      // Rounding must not push the eaves below the bottom.
      while (shape.height_m - shape.roof_height_m < shape.min_height_m) {
        shape.roof_height_m = std::nextafter(shape.roof_height_m, 0.0);
      }
    }
  }

  // On pillars: free below. A bridge between buildings has one storey.
  if (!min_said && (type == "roof" || type == "carport" || type == "bridge")) {
    const double thickness_m = type == "bridge" ? defaults.level_m : kSlab_m;
    shape.min_height_m = std::max(0.0, shape.height_m - shape.roof_height_m - thickness_m);
  }

  std::string_view direction = tags.text("roof:direction");
  if (direction.empty()) direction = tags.text("roof:slope:direction");
  if (!direction.empty() && direction != "along" && direction != "across") {
    shape.roof_direction_rad = parse_direction_rad(direction);
    if (!shape.roof_direction_rad) {
      tags.warn(fmt::format("roof:direction={} is no direction; left out", Tags::shown(direction)));
    }
  }
  const std::string_view orientation = tags.text("roof:orientation");
  shape.roof_across = orientation == "across" || direction == "across";
  if (!orientation.empty() && orientation != "across" && orientation != "along") {
    tags.warn(
        fmt::format("roof:orientation={} is neither along nor across; left out", Tags::shown(orientation)));
  }

  shape.facade = first_material(
      tags, {"building:facade:material", "facade:material", "building:material", "building:cladding"});
  shape.roof_material = first_material(tags, {"roof:material", "building:roof:material"});
  return shape;
}

city::FacadeMix facades_from_tags(const std::map<std::string, std::string>& tags) {
  using city::FacadeMix;
  // Coated glass came to buildings about 1980 and has been usual in new ones since about 1995.
  constexpr int kFirstCoated = 1980, kUsuallyCoated = 1995;
  const auto text = [&tags](const char* key) {
    const auto found = tags.find(key);
    return found != tags.end() ? lower_case(found->second) : std::string();
  };
  std::string use = text("building");
  if (use.empty() || use == "yes") use = text("building:part");
  // 31001_2020: the class of buildings, and their function.
  const std::string function = text("function"), code = function.substr(function.find('_') + 1);
  if (code.size() == 4 && parse_double(code)) {
    if (code == "2020") use = "office";
    if (code == "3041" || code == "3042") use = "church";
  } else if (!function.empty() && (use.empty() || use == "yes")) {
    use = function;
  }
  const std::optional<double> year = parse_double(text("start_date").substr(0, 4));
  if (year && *year > 1000 && *year < kFirstCoated) return FacadeMix::Traditional;
  const auto known = kFacadesOfUses.find(use);
  if (known == kFacadesOfUses.end()) return FacadeMix::ByBuilding;
  const bool fits = known->second != FacadeMix::ThermallyEfficient || (year && *year >= kUsuallyCoated);
  return fits ? known->second : FacadeMix::ByBuilding;
}

}  // namespace canyon::buildings
