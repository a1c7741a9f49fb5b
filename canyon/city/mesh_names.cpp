#include "canyon/city/mesh_names.hpp"

#include <cctype>
#include <utility>

namespace canyon::city {
namespace {

bool is_letter(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) != 0;
}
bool is_upper(char c) {
  return std::isupper(static_cast<unsigned char>(c)) != 0;
}

}  // namespace

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
    for (const std::string_view word : split(words, '|')) {
      if (text.find(word) != std::string::npos) return material;
    }
  }
  return Material::Unknown;
}

}  // namespace canyon::city
