#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace canyon::gnss {

/// Method of a position.
enum class FixKind : std::uint8_t {
  None,           ///< no position
  Single,         ///< satellites of this epoch, without corrections
  Differential,   ///< code measurements, corrected by those of a base
  Float,          ///< carrier phases relative to a base, real-valued ambiguities
  Fixed,          ///< likewise, integer ambiguities
  DeadReckoning,  ///< prediction without satellites of this epoch
  Combined,       ///< Single, together with the vehicle's sensors
};
/// "none", "single", "differential", "float", "fixed", "dead reckoning", "combined".
[[nodiscard]] constexpr std::string_view name(FixKind kind) {
  constexpr std::array<std::string_view, 7> kNames{"none",  "single",         "differential", "float",
                                                   "fixed", "dead reckoning", "combined"};
  return kNames.at(static_cast<std::size_t>(kind));
}
/// Whether it uses a base's corrections: Differential, Float, Fixed.
[[nodiscard]] constexpr bool corrected(FixKind kind) {
  return kind == FixKind::Differential || kind == FixKind::Float || kind == FixKind::Fixed;
}

}  // namespace canyon::gnss
