#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "canyon/run/epoch.hpp"

namespace canyon::output {

/// A whole NMEA 0183 sentence of `body` ("GPGGA,..."): "$", body, "*", checksum (XOR of the body's bytes, two
/// capital hexadecimal digits), CR LF.
[[nodiscard]] std::string nmea_sentence(std::string_view body);

/// Satellite number of NMEA 0183 v4.11 within its system: GPS 1 to 32, GLONASS 65 to 96 (slot + 64), Galileo
/// 1 to 36, BeiDou 1 to 63, QZSS 1 to 10 (PRN - 192), SBAS 33 to 64 (PRN - 87, to PRN 151), among GPS's.
/// Empty for satellites that the standard has no number for (GPS 33 and up would read as SBAS).
[[nodiscard]] std::optional<int> nmea_satellite_number(gnss::SatelliteId id);

/// The GGA sentence of an epoch, as a rover sends it to a caster.
[[nodiscard]] std::string nmea_gga(const simulation::Epoch& epoch);

/// RMC, GGA, GSA (one for each system, or for each 12 satellites of it), GST, GSV of one epoch.
[[nodiscard]] std::string nmea_epoch(const simulation::Epoch& epoch);

}  // namespace canyon::output
