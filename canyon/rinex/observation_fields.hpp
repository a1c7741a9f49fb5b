#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/rinex/fields.hpp"

// Fields and epoch lines of observation files, for RinexObservationReader.

namespace canyon::rinex {

/// Nothing but spaces, or nothing.
[[nodiscard]] bool is_blank(std::string_view text);

enum class Field : std::uint8_t { Blank, Number, Bad };
/// A number between spaces. Digits with one point, as RINEX writes numbers, are exact to the last bit up to
/// 15 digits, being the quotient of two integers that doubles hold; anything else is parse_double()'s.
/// `value` is set for Number only.
[[nodiscard]] Field parse_field(std::string_view text, double& value);

/// Kinds of observations: pseudorange, phase, Doppler, C/N0.
inline constexpr std::string_view kObservationKinds = "CLDS";

/// Ranges of measurements on and near the Earth; fill values and other units lie outside. Clocks may be off
/// by up to a quarter of a second.
struct Plausible {
  const char *what, *unit;
  double least, most;
};
inline constexpr std::array<Plausible, 4> kPlausibleValues{{{"pseudorange", "m", 1e7, 1e8},
                                                            {"carrier phase", "cycles", -1e11, 1e11},
                                                            {"Doppler", "Hz", -1e5, 1e5},
                                                            {"C/N0", "dB-Hz", 0, 80}}};

struct EpochLine {
  int flag = 0;           ///< 0 to 6
  std::size_t count = 0;  ///< of satellites, or records of an event
  /// Empty only for events (flags 2 to 5) that leave it out.
  std::optional<geodesy::GpsTime> time;
  std::optional<double> clock_offset_s;
};
/// An epoch line of version 2, and of versions 3 and 4, in a file of that time system; empty for any other
/// line and for damaged ones. The satellites that follow in version 2 are not looked at.
[[nodiscard]] std::optional<EpochLine> epoch_line2(std::string_view line, std::string_view time_system);
[[nodiscard]] std::optional<EpochLine> epoch_line3(std::string_view line, std::string_view time_system);

// Meanings of the codes of observation files, for RinexObservationReader: RINEX 3.05, tables 4 to 10; 2.11,
// table A1, and 2.12.

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
