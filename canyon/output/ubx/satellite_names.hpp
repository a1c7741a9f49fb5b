#pragma once

#include <cstdint>
#include <optional>

#include "canyon/gnss/signals.hpp"

namespace canyon::output::ubx {

/// A satellite as UBX names it (UBX-22008968, 1.5.2).
struct SatelliteName {
  std::uint8_t gnss = 0;  ///< 0 GPS, 1 SBAS, 2 Galileo, 3 BeiDou, 5 QZSS, 6 GLONASS
  std::uint8_t satellite = 0;
};
/// Empty for satellites that it has no number for (frozen skies with more than 32).
[[nodiscard]] std::optional<SatelliteName> satellite_name(gnss::SatelliteId id);

/// The number of a satellite in messages that name it by one number (UBX-13003221, annex A), as MAVLink's do;
/// 0 for satellites that have none.
[[nodiscard]] int single_number(gnss::SatelliteId id);

/// Signal::ubx, or ubx_geo of a geostationary satellite. Empty for signals that UBX has no number for (L1C).
[[nodiscard]] std::optional<std::uint8_t> signal_number(gnss::SatelliteId id, const gnss::Signal& signal);
/// sigId of the signal whose navigation message broadcast::Schedule sends: L1 C/A, E1-B, B1I D1 or D2, L1OF.
[[nodiscard]] std::uint8_t message_signal(gnss::SatelliteId id);

}  // namespace canyon::output::ubx
