// Declared in canyon/city/buildings/sources/shape.hpp.
// Single tag values: lengths, directions, materials.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/named.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"
#include "canyon/city/buildings/sources/shape.hpp"

namespace canyon::buildings {
namespace {

constexpr double kMetresPerFoot = 0.3048;  // international foot and inch, exact
constexpr double kMetresPerInch = 0.0254;

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
}

/// Takes a decimal number (point or comma, sign, no exponent) off the front of `text`.
std::optional<double> take_number(std::string_view& text) {
  std::size_t end = 0;
  bool digits = false;
  std::size_t mark = std::string_view::npos;
  while (end < text.size()) {
    const char c = text[end];
    if (c >= '0' && c <= '9') {
      digits = true;
    } else if ((c == '.' || c == ',') && mark == std::string_view::npos) {
      mark = end;
    } else if (!((c == '-' || c == '+') && end == 0)) {
      break;
    }
    ++end;
  }
  if (!digits) return {};
  std::string number(text.substr(0, end));
  if (mark != std::string_view::npos && number[mark] == ',') {
    // "1,500" is fifteen hundred to some and one and a half to others.
    if (number.size() - mark - 1 == 3) return {};
    number[mark] = '.';
  }
  text = trim(text.substr(end));
  return parse_double(number);
}

}  // namespace

std::optional<double> parse_length_m(std::string_view text) {
  if (text.size() > 64) return {};
  std::string words = lower_case(trim(text));
  replace_all(words, "\xE2\x80\xB2", "'");   // prime
  replace_all(words, "\xE2\x80\x99", "'");   // right single quotation mark
  replace_all(words, "\xE2\x80\xB3", "\"");  // double prime
  replace_all(words, "''", "\"");
  std::string_view rest = words;
  for (const std::string_view about : {"~", "about", "approx.", "approx", "circa", "ca.", "ca "}) {
    if (rest.substr(0, about.size()) == about) rest = trim(rest.substr(about.size()));
  }
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
                                          {"_", ""}}) {
    replace_all(wind, long_name, letter);
  }
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
