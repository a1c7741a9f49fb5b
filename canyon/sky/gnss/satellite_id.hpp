#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace canyon::gnss {

/// Satellite systems, in the order of every output.
enum class System : std::uint8_t { GPS, GLONASS, Galileo, BeiDou, QZSS, SBAS };

inline constexpr std::array<System, 6> kAllSystems{System::GPS,    System::GLONASS, System::Galileo,
                                                   System::BeiDou, System::QZSS,    System::SBAS};
inline constexpr std::size_t kSystemCount = kAllSystems.size();

/// Systems with their own time, and the default of a sky that names none: all but SBAS, of which most
/// receivers use only the corrections.
inline constexpr std::array<System, 5> kConstellations{System::GPS, System::GLONASS, System::Galileo,
                                                       System::BeiDou, System::QZSS};

/// The constellation whose time a system's satellites use: GPS's for SBAS, within 50 ns (ICAO Annex 10,
/// Volume I, 3.7.3.4.5), their own for all others.
[[nodiscard]] constexpr System clock_system(System system) {
  return system == System::SBAS ? System::GPS : system;
}

/// RINEX system letter: G, R, E, C, J, S.
[[nodiscard]] char letter(System system);
/// "GPS", "GLONASS", "Galileo", "BeiDou", "QZSS", "SBAS".
[[nodiscard]] std::string_view name(System system);
/// The system of a RINEX letter, or Q of QZSS; empty for I and anything unknown.
[[nodiscard]] std::optional<System> system_from_letter(char letter);
/// The system of a name of name(), in any case. Throws InputError with the list of names.
[[nodiscard]] System system_from_name(std::string_view name);

/// One satellite by its RINEX 3 number: PRN for GPS, Galileo, BeiDou; slot for GLONASS; PRN - 192 for QZSS;
/// PRN - 100 for SBAS.
struct SatelliteId {
  System system = System::GPS;
  std::uint8_t number = 0;  ///< 1 to 99

  friend constexpr auto operator<=>(SatelliteId, SatelliteId) = default;
};

/// A unique number of a satellite below 1024.
[[nodiscard]] constexpr std::size_t dense_index(SatelliteId id) {
  return static_cast<std::size_t>(id.system) * 128 + id.number;
}

/// "G05".
[[nodiscard]] std::string to_string(SatelliteId id);
/// Parses "G05", "G 5" or "g5"; empty for anything else.
[[nodiscard]] std::optional<SatelliteId> parse_satellite(std::string_view text);

/// Carrier frequency [Hz] of the system's open civil signal near L1: L1 C/A, G1 (channel), E1, B1I, SBAS L1.
/// @param glonass_channel frequency channel k, -7 to +6 (used by GLONASS only)
[[nodiscard]] double l1_frequency_hz(System system, int glonass_channel = 0);

}  // namespace canyon::gnss
