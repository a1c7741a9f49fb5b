#include "canyon/city/mesh_marks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <unordered_map>
#include <utility>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"

namespace canyon::city {
namespace {

constexpr std::size_t kMaxName = 120;
constexpr unsigned kRepeatMark = 0xFFFE;

constexpr std::array<std::string_view, 4> kSurfaceWords{"building", "terrain", "foliage", "vehicle"};

struct MaterialLook {
  std::string_view name;
  std::array<double, 3> colour;
};
constexpr std::array<MaterialLook, 10> kMaterials{{{"unknown", {0.65, 0.65, 0.65}},
                                                   {"concrete", {0.60, 0.60, 0.57}},
                                                   {"glass", {0.35, 0.55, 0.70}},
                                                   {"brick", {0.60, 0.30, 0.22}},
                                                   {"metal", {0.55, 0.57, 0.60}},
                                                   {"stone", {0.70, 0.66, 0.58}},
                                                   {"wood", {0.45, 0.36, 0.20}},
                                                   {"plaster", {0.85, 0.82, 0.74}},
                                                   {"ground", {0.36, 0.40, 0.31}},
                                                   {"foliage", {0.24, 0.42, 0.18}}}};

/// Value of an escape "_x1F00_" at `at`.
std::optional<unsigned> escape_at(std::string_view text, std::size_t at) {
  if (at + 7 > text.size() || text[at] != '_' || text[at + 1] != 'x' || text[at + 6] != '_')
    return std::nullopt;
  unsigned value = 0;
  for (std::size_t i = at + 2; i < at + 6; ++i) {
    const char c = text[i];
    if (c >= '0' && c <= '9')
      value = value * 16 + static_cast<unsigned>(c - '0');
    else if (c >= 'A' && c <= 'F')
      value = value * 16 + static_cast<unsigned>(c - 'A' + 10);
    else
      return std::nullopt;
  }
  return value;
}

bool holds(NameCharacters characters, unsigned char c, bool first) {
  switch (characters) {
    case NameCharacters::Utf8:
      return c >= 0x20 && c != 0x7F;
    case NameCharacters::Word:
      return c > 0x20 && c != 0x7F && c != '\\' && c != '#';
    case NameCharacters::XmlName:
      if (first && (c < 'A' || c == '_')) return c == '_';
      return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_' ||
             c == '-' || c == '.';
  }
  return false;
}

std::string escaped(std::string_view text, NameCharacters characters) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const auto c = static_cast<unsigned char>(text[at]);
    const std::size_t length = utf8_length(text, at);
    if (length > 1) {
      result += text.substr(at, length);
      at += length;
      continue;
    }
    if (length == 0 || !holds(characters, c, at == 0) || escape_at(text, at))
      result += fmt::format("_x{:04X}_", c);
    else
      result += static_cast<char>(c);
    ++at;
  }
  return result;
}

std::string cut(std::string_view name) {
  if (name.size() <= kMaxName) return std::string(name);
  std::size_t end = 0;
  for (std::size_t at = 0; at <= kMaxName; at += std::max<std::size_t>(1, utf8_length(name, at))) end = at;
  return std::string(name.substr(0, end));
}

Surface surface_by_words(std::string_view name) {
  const MeshImportOptions options;
  const bool terrain = std::any_of(options.terrain_names.begin(), options.terrain_names.end(),
                                   [&](const std::string& word) { return has_word(name, word); });
  return terrain ? Surface::Terrain : Surface::Building;
}

bool is_letter(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) != 0;
}
bool is_upper(char c) {
  return std::isupper(static_cast<unsigned char>(c)) != 0;
}

}  // namespace

bool has_mesh_mark(const std::filesystem::path& path) {
  return read_head(path, std::size_t{1} << 16).find(kMeshMark) != std::string::npos;
}

NodeName split_surface(std::string_view name, bool* marked) {
  if (marked != nullptr) *marked = false;
  for (std::size_t i = 0; i < kSurfaceWords.size(); ++i) {
    const std::string_view word = kSurfaceWords[i];
    if (name.size() > word.size() && name.substr(0, word.size()) == word && name[word.size()] == ':') {
      if (marked != nullptr) *marked = true;
      return {std::string(name.substr(word.size() + 1)), static_cast<Surface>(i)};
    }
  }
  return {std::string(name), surface_by_words(name)};
}

std::vector<std::string> node_names(const std::vector<Object>& objects, NameCharacters characters) {
  std::vector<std::string> names;
  names.reserve(objects.size());
  std::unordered_map<std::string, std::size_t> seen;
  for (const Object& object : objects) {
    std::string name = cut(object.name);
    const NodeName plain = split_surface(name);
    // An unnamed node gets the name of its file.
    if (name.empty() || plain.surface != object.surface || plain.name != name)
      name = std::string(kSurfaceWords.at(static_cast<std::size_t>(object.surface))) + ':' + name;
    name = escaped(name, characters);
    if (characters != NameCharacters::Utf8) {
      const std::size_t number = ++seen[name];
      if (number > 1) name += fmt::format("_x{:04X}_{}", kRepeatMark, number);
    }
    names.push_back(std::move(name));
  }
  return names;
}

NodeName read_node_name(std::string_view node_name) {
  std::string name;
  for (std::size_t at = 0; at < node_name.size();) {
    const std::optional<unsigned> value = escape_at(node_name, at);
    if (value == kRepeatMark) break;
    if (value && *value < 0x100) {
      name += static_cast<char>(*value);
      at += 7;
    } else {
      name += node_name[at++];
    }
  }
  return split_surface(name);
}

std::string_view material_name(Material material) {
  return kMaterials.at(static_cast<std::size_t>(material)).name;
}

Material material_by_name(std::string_view name) {
  for (std::size_t i = 0; i < kMaterials.size(); ++i)
    if (kMaterials[i].name == name) return static_cast<Material>(i);
  return Material::Unknown;
}

std::array<double, 3> material_colour(Material material) {
  return kMaterials.at(static_cast<std::size_t>(material)).colour;
}

bool has_word(std::string_view text, std::string_view word) {
  if (word.empty()) return false;
  const std::string haystack = lower_case(text);
  const std::string needle = lower_case(word);
  for (std::size_t at = haystack.find(needle); at != std::string::npos; at = haystack.find(needle, at + 1)) {
    const std::size_t end = at + needle.size();
    const bool begins =
        at == 0 || !is_letter(text[at - 1]) || (is_upper(text[at]) && !is_upper(text[at - 1]));
    const bool ends =
        end == text.size() || !is_letter(text[end]) || (is_upper(text[end]) && !is_upper(text[end - 1]));
    if (begins && ends) return true;
  }
  return false;
}

Material material_from_name(std::string_view name) {
  static constexpr std::pair<std::string_view, Material> kWords[]{
      {"concrete|cement", Material::Concrete},   {"glass|window", Material::Glass},
      {"brick|tiles", Material::Brick},          {"metal|steel|aluminium", Material::Metal},
      {"stone|granite|marble", Material::Stone}, {"wood", Material::Wood},
      {"plaster|stucco", Material::Plaster},     {"foliage", Material::Foliage}};
  const std::string text = lower_case(name);
  for (const auto& [words, material] : kWords) {
    for (const std::string_view word : split(words, '|'))
      if (text.find(word) != std::string::npos) return material;
  }
  return Material::Unknown;
}

void MeshImportOptions::validate() const {
  geodesy::check_geodetic(origin, "city origin");
  if (!offset_m.allFinite() || offset_m.norm() > 1e6) {
    throw InputError("city offset must be finite and at most 1,000 km",
                     "give east_m, north_m and up_m in metres");
  }
  options::check(*this, "city mesh");
}

void visit(options::Visitor& v, MeshImportOptions& o) {
  static constexpr std::string_view kAxes[]{"Y", "Z"};
  constexpr options::Range kLocal_m{-1e6, 1e6};
  v.section("offset", [&] {
    v.number({"east_m", "m", "moves the mesh eastwards in its ENU frame"}, o.offset_m.x(), kLocal_m);
    v.number({"north_m", "m", "moves it northwards"}, o.offset_m.y(), kLocal_m);
    v.number({"up_m", "m", "moves it upwards"}, o.offset_m.z(), kLocal_m);
  });
  v.angle({"heading_deg", "deg", "rotates the mesh counter-clockwise seen from above"}, o.heading_rad,
          {-360, 360});
  v.number({"scale", "", "scale factor in addition to the unit declared in the file"}, o.scale,
           {0, 1e6, true});
  std::string axis = o.up_axis ? std::string(1, *o.up_axis) : "";
  v.word({"up_axis", "", "up axis, Y or Z, if the file has none or a wrong one", "the file's"}, axis, kAxes);
  if (v.reads() && !axis.empty()) o.up_axis = axis.front();
  v.texts({"terrain_names", "", "words in node names that mark terrain"}, o.terrain_names);
}

}  // namespace canyon::city
