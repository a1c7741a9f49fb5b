#pragma once

#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon {

/// The hint for an unknown name: "did you mean 'X'? known: X, Y". More than 20 known names are listed only if
/// none is close.
[[nodiscard]] inline std::string known_names(std::string_view name, const std::vector<std::string>& known) {
  const std::optional<std::string> similar = closest(name, known);
  std::string text = did_you_mean(similar);
  constexpr std::size_t kLongList = 20;
  if (similar && known.size() > kLongList) return text;
  text += similar ? " known: " : "known: ";
  for (const std::string& each : known) text += (&each == known.data() ? "" : ", ") + each;
  return text;
}

/// "there is no KIND 'NAME'; did you mean 'X'? known: X, Y"
[[nodiscard]] inline InputError unknown_name(std::string_view kind, std::string_view name,
                                             const std::vector<std::string>& known) {
  return InputError(std::string("there is no ").append(kind).append(" '").append(name).append("'"),
                    known_names(name, known));
}

/// The entry of a table with that `name`. Throws unknown_name() if there is none.
template <typename Table>
[[nodiscard]] const auto& entry_named(const Table& table, std::string_view name, std::string_view kind) {
  std::vector<std::string> known;
  for (const auto& entry : table) {
    if (entry.name == name) return entry;
    known.emplace_back(entry.name);
  }
  throw unknown_name(kind, name, known);
}

/// Maps each word of the lists ("glass|mirror", literals) to its list's value; of equal words, the first one
/// is used.
template <typename Value>
[[nodiscard]] std::map<std::string_view, Value> dictionary(
    std::initializer_list<std::pair<std::string_view, Value>> lists) {
  std::map<std::string_view, Value> words;
  for (const auto& [list, value] : lists)
    for (const std::string_view word : split(list, '|')) words.emplace(word, value);
  return words;
}

}  // namespace canyon
