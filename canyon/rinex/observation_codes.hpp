#pragma once

#include <span>
#include <string_view>

#include "canyon/gnss/signals.hpp"

// Meanings of the codes of observation files, for RinexObservationReader: RINEX 3.05, tables 4 to 10; 2.11,
// table A1, and 2.12.

namespace canyon::rinex {

/// Where versions 2.x have the values of a code.
struct Version2Types {
  std::string_view systems;  ///< letters
  std::string_view code;     ///< as versions 3 and 4 write it
  std::string_view range;    ///< type of the pseudorange
  char band;                 ///< of phase, Doppler and strength: L1, D1, S1
  double from, before;       ///< versions
};
[[nodiscard]] std::span<const Version2Types> version2_types();

/// Whether any signal of a system is read of a code in files of versions 3 and 4.
[[nodiscard]] bool is_known_code(gnss::System system, std::string_view code, double version);

}  // namespace canyon::rinex
