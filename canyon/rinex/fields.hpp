#pragma once

#include <cstddef>
#include <string_view>

namespace canyon::rinex {

/// A file that is damaged throughout says so in so many lines and a count.
inline constexpr std::size_t kListedDamages = 20;

[[nodiscard]] constexpr bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// "I05": of a system that exists and that Canyon does not use (NavIC).
[[nodiscard]] constexpr bool other_system(std::string_view name) {
  return name.size() == 3 && name[0] == 'I' && (is_digit(name[1]) || name[1] == ' ') && is_digit(name[2]);
}

}  // namespace canyon::rinex
