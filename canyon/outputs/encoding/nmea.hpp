#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "canyon/simulation/epoch.hpp"

namespace canyon::encoding {

/// The complete NMEA 0183 sentence of `body` ("GPGGA,..."): "$", body, "*", checksum (XOR of the body's
/// bytes, two capital hexadecimal digits), CR LF.
[[nodiscard]] std::string nmea_sentence(std::string_view body);

/// Satellite number of NMEA 0183 v4.11 within its system: GPS 1 to 32, GLONASS 65 to 96 (slot + 64), Galileo
/// 1 to 36, BeiDou 1 to 63, QZSS 1 to 10 (PRN - 192), SBAS 33 to 64 (PRN - 87, to PRN 151) as part of GPS.
/// Empty for satellites without a number in the standard (GPS 33 and up would be read as SBAS).
[[nodiscard]] std::optional<int> nmea_satellite_number(gnss::SatelliteId id);

/// The GGA sentence of an epoch, as sent by a rover to a caster.
[[nodiscard]] std::string nmea_gga(const simulation::Epoch& epoch);

/// RMC, GGA, GSA (one for each system and each 12 of its satellites), GST, GSV of one epoch.
[[nodiscard]] std::string nmea_epoch(const simulation::Epoch& epoch);

}  // namespace canyon::encoding
