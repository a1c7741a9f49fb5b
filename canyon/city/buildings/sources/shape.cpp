// Height, roof and material of a building from its tags: OSM wiki, "Simple 3D Buildings".
#include "canyon/city/buildings/sources/shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/named.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"

namespace canyon::buildings {
namespace {

constexpr double kHighest_m = 2000;          // a larger value is a mistake
constexpr double kThinnest_m = 0.1;          // a lower building is a mistake
constexpr double kMaxLevels = 200;           // the highest building has 163
constexpr double kSlab_m = 0.3;              // thickness of a roof on pillars
constexpr double kLowestTaggedLevel_m = 2;   // storey heights outside these limits
constexpr double kHighestTaggedLevel_m = 8;  // are not used

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

// Shapes without an implementation, by the nearest one with the same eaves and ridge.
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

/// A feature's tags; reading them may add warnings.
class Tags {
 public:
  Tags(const std::map<std::string, std::string>& tags, const std::string& id,
       std::vector<std::string>& warnings)
      : tags_(tags), id_(id), warnings_(warnings) {}

  [[nodiscard]] std::string_view text(const char* key) const { return tag(tags_, key); }
  void warn(std::string_view problem) const { warnings_.push_back(fmt::format("{}: {}", id_, problem)); }

  /// The first of `keys` with a length within [lowest, kHighest_m].
  [[nodiscard]] std::optional<double> length_m(std::initializer_list<const char*> keys, double lowest) const {
    for (const char* key : keys) {
      const std::string_view value = text(key);
      if (value.empty()) continue;
      const std::optional<double> length = parse_length_m(value);
      if (length && *length >= lowest && *length <= kHighest_m) return length;
      if (length)
        warn(fmt::format("{}={} is outside [{}, {}] m; left out", key, shown(value), lowest, kHighest_m));
      else
        warn(fmt::format("{}={} is not a length; left out", key, shown(value)));
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
    if (count && *count >= 0 && *count <= kMaxLevels) return count;
    warn(fmt::format("{}={} is not a number of storeys within [0, {}]; left out", key, shown(value),
                     kMaxLevels));
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
  for (const auto& [shape, shape_name] : kRoofNames)
    if (word == shape_name) return shape;
  const auto fallback = kRoofFallbacks.find(word);
  if (fallback != kRoofFallbacks.end()) return fallback->second;
  tags.warn(fmt::format("roof:shape={} is unknown; built flat", Tags::shown(text)));
  return RoofShape::Flat;
}

/// roof:angle in radians: the slope of the roof's faces.
std::optional<double> read_roof_angle(const Tags& tags) {
  std::string text(tags.text("roof:angle").substr(0, 64));
  if (text.empty()) return std::nullopt;
  for (const std::string_view unit : {"\xC2\xB0", "degrees", "deg"})
    if (text.ends_with(unit)) text.resize(text.size() - unit.size());
  std::replace(text.begin(), text.end(), ',', '.');
  constexpr double kSteepest_deg = 85;
  const std::optional<double> angle_deg = parse_double(text);
  if (angle_deg && *angle_deg > 0 && *angle_deg <= kSteepest_deg) return geodesy::radians(*angle_deg);
  tags.warn(fmt::format("roof:angle={} is not an angle in (0, {}] deg; left out",
                        Tags::shown(tags.text("roof:angle")), kSteepest_deg));
  return std::nullopt;
}

city::Material first_material(const Tags& tags, std::initializer_list<const char*> keys) {
  for (const char* key : keys) {
    const city::Material material = material_from_tag(tags.text(key));
    if (material != city::Material::Unknown) return material;
  }
  return city::Material::Concrete;
}

// Commercial buildings only if they are new; see facades_from_tags().
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

/// Builds a Shape from its tags, in the order of their dependencies.
class ShapeReader {
 public:
  ShapeReader(const Tags& tags, const HeightDefaults& defaults) : tags_(tags), defaults_(defaults) {
    shape_.roof = read_roof_shape(tags);
    height_ = tags.length_m({"height", "building:height", "est_height"}, kThinnest_m);
    min_height_ = tags.length_m({"min_height", "building:min_height"}, 0);
    levels_ = tags.levels("building:levels");
    if (!levels_) levels_ = tags.levels("building:levels:aboveground");
    min_level_ = tags.levels("building:min_level");
    roof_levels_ = tags.levels("roof:levels").value_or(0);
    if (pitched())
      roof_height_ = tags.length_m({"roof:height"}, 0);
    else if (!tags.text("roof:shape").empty())
      roof_levels_ = 0;
  }

  Shape read() {
    reconcile_tags();
    set_storey_height();
    set_height();
    set_bottom();
    if (pitched()) set_roof_height();
    set_bottom_on_pillars();
    set_roof_direction();
    shape_.facade = first_material(
        tags_, {"building:facade:material", "facade:material", "building:material", "building:cladding"});
    shape_.roof_material = first_material(tags_, {"roof:material", "building:roof:material"});
    return shape_;
  }

 private:
  [[nodiscard]] bool pitched() const { return shape_.roof != RoofShape::Flat; }
  [[nodiscard]] std::string shown(const char* key) const { return Tags::shown(tags_.text(key)); }

  void reconcile_tags() {
    if (height_ && min_height_ && *min_height_ > *height_ - kThinnest_m) {
      tags_.warn(fmt::format("min_height={} reaches height={}; min_height left out", shown("min_height"),
                             shown("height")));
      min_height_.reset();
    }
    // building:levels counts from the ground, with those below building:min_level; some maps count otherwise.
    if (levels_ && min_level_ && *levels_ > 0 && *levels_ <= *min_level_) {
      tags_.warn(fmt::format(
          "building:levels={} does not reach above building:min_level={}; read as the storeys above it",
          *levels_, *min_level_));
      *levels_ += *min_level_;
    }
  }

  /// The storey height that follows from height and storeys if both are tagged, else the default.
  void set_storey_height() {
    level_m_ = defaults_.level_m;
    if (height_ && levels_ && *levels_ > 0) {
      const double walls_m = *height_ - roof_height_.value_or(0);
      const double implied_m = walls_m / (*levels_ + (roof_height_ ? 0 : roof_levels_));
      if (implied_m >= kLowestTaggedLevel_m && implied_m <= kHighestTaggedLevel_m) level_m_ = implied_m;
    }
    if (!min_height_ && min_level_ && *min_level_ > 0) min_height_ = *min_level_ * level_m_;
  }

  void set_height() {
    if (height_) {
      shape_.height_m = *height_;
      shape_.height_source = HeightSource::Tag;
      return;
    }
    if (levels_ && *levels_ + roof_levels_ + roof_height_.value_or(0) > 0) {
      shape_.height_m = height_of_levels();
      if (shape_.height_m <= kHighest_m) {
        shape_.height_source = HeightSource::Levels;
        return;
      }
      tags_.warn(fmt::format("storeys and roof add up to {} m; left out", shape_.height_m));
    }
    if (levels_ && *levels_ == 0) tags_.warn("zero storeys give no height; the height of its type is used");
    const auto by_type = defaults_.by_type.find(type_);
    shape_.height_m = by_type != defaults_.by_type.end() ? by_type->second : defaults_.building_m;
    shape_.height_source = HeightSource::Default;
  }

  [[nodiscard]] double height_of_levels() const {
    const double walls_m = *levels_ * defaults_.level_m;
    if (roof_height_) return walls_m + *roof_height_;
    if (roof_levels_ > 0 || !pitched()) return walls_m + roof_levels_ * defaults_.level_m;
    // A roof without a height is added to the storeys: one storey high, at most half of the height below it.
    const double below_m = walls_m - std::min(walls_m, min_height_.value_or(0));
    return walls_m + std::min(defaults_.level_m, below_m / 2);
  }

  void set_bottom() {
    if (min_height_.value_or(0) > shape_.height_m - kThinnest_m) {
      if (height_) {  // min_height_ is from building:min_level: the height is more reliable
        tags_.warn(fmt::format("building:min_level={} reaches height={}; left out", min_level_.value_or(0),
                               shown("height")));
        min_height_.reset();
      } else {  // only known: something is above min_height
        shape_.height_m = min_height_.value_or(0) + std::max(defaults_.level_m, kThinnest_m);
        shape_.height_source = HeightSource::Default;
      }
    }
    shape_.min_height_m = min_height_.value_or(0);
  }

  void set_roof_height() {
    const double max_m = shape_.height_m - shape_.min_height_m;
    if (roof_height_ && *roof_height_ > max_m * (1 + 1e-9)) {
      tags_.warn(fmt::format("roof:height={} is higher than the building's {} m; left out",
                             shown("roof:height"), max_m));
      roof_height_.reset();
    }
    if (roof_height_ && *roof_height_ == 0) {
      shape_.roof = RoofShape::Flat;
      shape_.roof_source = HeightSource::Tag;
      return;
    }
    const double default_m = std::min(defaults_.level_m, max_m / 3);
    const std::optional<double> roof_m = roof_height_ ? roof_height_ : roof_of_levels(max_m, default_m);
    if (!roof_height_) shape_.roof_angle_rad = read_roof_angle(tags_);
    shape_.roof_source = roof_height_ || (!roof_m && shape_.roof_angle_rad) ? HeightSource::Tag
                         : roof_m                                           ? HeightSource::Levels
                                                                            : HeightSource::Default;
    shape_.roof_height_m = std::min(roof_m.value_or(default_m), max_m);
    // Rounding must not move the eaves below the bottom.
    while (shape_.height_m - shape_.roof_height_m < shape_.min_height_m)
      shape_.roof_height_m = std::nextafter(shape_.roof_height_m, 0.0);
  }

  /// The roof's height by its own storeys, else the rest of the height above the building's storeys.
  [[nodiscard]] std::optional<double> roof_of_levels(double max_m, double default_m) const {
    if (roof_levels_ > 0) {
      const double wanted_m = roof_levels_ * (height_ ? level_m_ : defaults_.level_m);
      if (wanted_m <= max_m * (1 + 1e-9)) return wanted_m;
      tags_.warn(
          fmt::format("roof:levels={} are higher than the building's {} m; left out", roof_levels_, max_m));
    } else if (height_ && levels_ && *levels_ > 0) {
      const double left_m = *height_ - *levels_ * defaults_.level_m;
      if (left_m >= default_m / 2 && left_m <= max_m / 2) return left_m;  // a plausible part
    }
    return std::nullopt;
  }

  /// A roof on pillars is open below; a bridge between buildings has one storey.
  void set_bottom_on_pillars() {
    if (min_height_ || (type_ != "roof" && type_ != "carport" && type_ != "bridge")) return;
    const double thickness_m = type_ == "bridge" ? defaults_.level_m : kSlab_m;
    shape_.min_height_m = std::max(0.0, shape_.height_m - shape_.roof_height_m - thickness_m);
  }

  void set_roof_direction() {
    std::string_view direction = tags_.text("roof:direction");
    if (direction.empty()) direction = tags_.text("roof:slope:direction");
    if (!direction.empty() && direction != "along" && direction != "across") {
      shape_.roof_direction_rad = parse_direction_rad(direction);
      if (!shape_.roof_direction_rad)
        tags_.warn(fmt::format("roof:direction={} is not a direction; left out", Tags::shown(direction)));
    }
    const std::string_view orientation = tags_.text("roof:orientation");
    shape_.roof_across = orientation == "across" || direction == "across";
    if (!orientation.empty() && orientation != "across" && orientation != "along") {
      tags_.warn(
          fmt::format("roof:orientation={} is neither along nor across; left out", Tags::shown(orientation)));
    }
  }

  const Tags& tags_;
  const HeightDefaults& defaults_;
  const std::string type_ = building_type(tags_);
  // Valid tags; of two contradicting tags one is cleared.
  std::optional<double> height_, min_height_, levels_, min_level_, roof_height_;
  double roof_levels_ = 0;
  double level_m_ = 0;  ///< height of a storey
  Shape shape_;
};

constexpr double kMetresPerFoot = 0.3048;  // international foot and inch, exact
constexpr double kMetresPerInch = 0.0254;

/// Consumes a decimal number (point or comma, sign, no exponent) at the front of `text`.
std::optional<double> take_number(std::string_view& text) {
  std::size_t end = 0;
  bool digits = false;
  std::size_t mark = std::string_view::npos;
  while (end < text.size()) {
    const char c = text[end];
    if (c >= '0' && c <= '9')
      digits = true;
    else if ((c == '.' || c == ',') && mark == std::string_view::npos)
      mark = end;
    else if (!((c == '-' || c == '+') && end == 0))
      break;
    ++end;
  }
  if (!digits) return {};
  std::string number(text.substr(0, end));
  if (mark != std::string_view::npos && number[mark] == ',') {
    // "1,500" is ambiguous: fifteen hundred, or one and a half.
    if (number.size() - mark - 1 == 3) return {};
    number[mark] = '.';
  }
  text = trim(text.substr(end));
  return parse_double(number);
}

}  // namespace

std::string_view name(RoofShape shape) {
  for (const auto& [value, text] : kRoofNames)
    if (value == shape) return text;
  return "flat";
}

std::string_view name(HeightSource source) {
  constexpr std::array<std::string_view, 3> kNames{"height", "levels", "default"};
  return kNames[static_cast<std::size_t>(source)];
}

Shape shape_from_tags(const std::map<std::string, std::string>& raw, const HeightDefaults& defaults,
                      const std::string& id, std::vector<std::string>& warnings) {
  return ShapeReader(Tags(raw, id, warnings), defaults).read();
}

city::FacadeMix facades_from_tags(const std::map<std::string, std::string>& tags) {
  using city::FacadeMix;
  // Coated glass was introduced in buildings about 1980 and has been usual in new ones since about 1995.
  constexpr int kFirstCoated = 1980, kUsuallyCoated = 1995;
  const auto text = [&tags](const char* key) {
    const auto found = tags.find(key);
    return found != tags.end() ? lower_case(found->second) : std::string();
  };
  std::string use = text("building");
  if (use.empty() || use == "yes") use = text("building:part");
  const std::optional<double> year = parse_double(text("start_date").substr(0, 4));
  if (year && *year > 1000 && *year < kFirstCoated) return FacadeMix::Traditional;
  const std::string structure = text("building:structure");
  if (structure == "wood" || structure == "masonry") return FacadeMix::Traditional;
  const auto known = kFacadesOfUses.find(use);
  if (known == kFacadesOfUses.end()) return FacadeMix::ByBuilding;
  const bool fits = known->second != FacadeMix::ThermallyEfficient || (year && *year >= kUsuallyCoated);
  return fits ? known->second : FacadeMix::ByBuilding;
}

std::optional<double> parse_length_m(std::string_view text) {
  if (text.size() > 64) return {};
  std::string words = lower_case(trim(text));
  replace_all(words, "\xE2\x80\xB2", "'");   // prime
  replace_all(words, "\xE2\x80\x99", "'");   // right single quotation mark
  replace_all(words, "\xE2\x80\xB3", "\"");  // double prime
  replace_all(words, "''", "\"");
  std::string_view rest = words;
  for (const std::string_view about : {"~", "about", "approx.", "approx", "circa", "ca.", "ca "})
    if (rest.substr(0, about.size()) == about) rest = trim(rest.substr(about.size()));
  const std::optional<double> value = take_number(rest);
  if (!value) return {};
  const std::string_view unit = rest.empty() ? "m" : rest == "'" ? "ft" : rest == "\"" ? "in" : rest;
  if (const auto metres = metres_of_unit(unit)) return *value * *metres;
  // Feet and inches: 3'6", 3' 6 in, 3 ft 6 in.
  std::size_t feet_end = 0;
  if (rest.substr(0, 1) == "'") feet_end = 1;
  if (rest.substr(0, 2) == "ft") feet_end = 2;
  if (feet_end == 0) return {};
  rest = trim(rest.substr(feet_end));
  if (rest.empty() || rest.front() < '0' || rest.front() > '9') return {};
  const std::optional<double> inches = take_number(rest);
  if (!inches || *inches >= 12) return {};
  if (!rest.empty() && rest != "\"" && rest != "in" && rest != "inch" && rest != "inches") return {};
  return *value * kMetresPerFoot + (std::signbit(*value) ? -1 : 1) * *inches * kMetresPerInch;
}

std::optional<double> parse_direction_rad(std::string_view text) {
  if (text.size() > 64) return {};
  std::string word = lower_case(trim(text));
  replace_all(word, "\xC2\xB0", "");  // degree sign
  static constexpr std::array<std::string_view, 16> kWinds{"n", "nne", "ne", "ene", "e", "ese", "se", "sse",
                                                           "s", "ssw", "sw", "wsw", "w", "wnw", "nw", "nnw"};
  std::string wind = word;
  for (const auto& [long_name, letter] : {std::pair<std::string_view, std::string_view>{"north", "n"},
                                          {"east", "e"},
                                          {"south", "s"},
                                          {"west", "w"},
                                          {"-", ""},
                                          {"_", ""}})
    replace_all(wind, long_name, letter);
  const auto found = std::find(kWinds.begin(), kWinds.end(), wind);
  if (found != kWinds.end()) return static_cast<double>(found - kWinds.begin()) * geodesy::kPi / 8;
  std::string_view rest = word;
  const std::optional<double> degrees = take_number(rest);
  if (!degrees || !(rest.empty() || rest == "deg" || rest == "degrees")) return {};
  if (std::abs(*degrees) > 360) return {};
  double azimuth_deg = std::fmod(*degrees, 360.0);
  if (azimuth_deg < 0) azimuth_deg += 360;
  return geodesy::radians(azimuth_deg);
}

city::Material material_from_tag(std::string_view value) {
  using city::Material;
  static const auto kWords = dictionary<Material>(
      {{"glass|mirror", Material::Glass},
       {"concrete|beton|cement|panel|panels|eternit", Material::Concrete},
       {"brick|bricks|clinker|tile|tiles|terracotta|sandlime|klinker", Material::Brick},
       {"metal|steel|copper|aluminium|aluminum|zinc|tin|iron|lead|titanium|brass|bronze|gold",
        Material::Metal},
       {"stone|sandstone|limestone|marble|granite|slate|flint|masonry|basalt|travertine|tuff",
        Material::Stone},
       {"wood|wooden|timber|log|logs|bamboo|weatherboard|weatherboarding", Material::Wood},
       {"plaster|plastered|plasterwork|stucco|render|rendered|rendering|roughcast|adobe|mud|loam|"
        "clay|limewashed|pebbledash",
        Material::Plaster}});
  if (value.size() > 255) return Material::Unknown;
  // The first of "glass;steel"; the last known word of "red_brick", "cement_block", "wood frame".
  std::string first = lower_case(trim(split(value, ';').front()));
  std::replace_if(
      first.begin(), first.end(), [](char c) { return c == '_' || c == '-' || c == '/' || c == ','; }, ' ');
  Material material = Material::Unknown;
  for (const std::string_view word : split_blanks(first)) {
    const auto found = kWords.find(word);
    if (found != kWords.end()) material = found->second;
  }
  return material;
}

}  // namespace canyon::buildings
