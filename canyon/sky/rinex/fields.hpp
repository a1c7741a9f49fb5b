#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include "canyon/base/geodesy/gps_time.hpp"

namespace canyon::rinex {

[[nodiscard]] constexpr bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// "I05": of a known system that Canyon does not use (NavIC).
[[nodiscard]] constexpr bool other_system(std::string_view name) {
  return name.size() == 3 && name[0] == 'I' && (is_digit(name[1]) || name[1] == ' ') && is_digit(name[2]);
}

/// The time systems of RINEX and SP3 files: GPS, GAL, QZS, IRN, BDT, TAI, UTC and GLO, which is UTC.
[[nodiscard]] bool is_time_system(std::string_view name);

struct FieldColumns {
  std::size_t begin, width;
};
/// The instant of year, month, day, hour, minute and second.
using TimeColumns = std::array<FieldColumns, 6>;
/// An instant of a time system. Years of two digits are 1980 to 2079 (RINEX 2.11, table A2), seconds may
/// reach
/// 61. Empty if a field is not a number or out of range.
[[nodiscard]] std::optional<geodesy::GpsTime> time_in(std::string_view line, const TimeColumns& columns,
                                                      std::string_view time_system);

}  // namespace canyon::rinex
