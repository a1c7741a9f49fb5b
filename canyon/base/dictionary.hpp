#pragma once

#include <initializer_list>
#include <map>
#include <string_view>
#include <utility>

#include "canyon/base/text.hpp"

namespace canyon {

/// Maps each word of the lists ("glass|mirror", literals) to its list's value; the first of equal words
/// counts.
template <typename Value>
[[nodiscard]] std::map<std::string_view, Value> dictionary(
    std::initializer_list<std::pair<std::string_view, Value>> lists) {
  std::map<std::string_view, Value> words;
  for (const auto& [list, value] : lists) {
    for (const std::string_view word : split(list, '|')) words.emplace(word, value);
  }
  return words;
}

}  // namespace canyon
