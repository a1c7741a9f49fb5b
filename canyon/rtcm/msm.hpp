#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "canyon/geodesy/constants.hpp"
#include "canyon/gnss/satellite_id.hpp"

// Common parts of messages of the Multiple Signal type (MSM): RTCM 10403.3, 3.5.16.

namespace canyon::rtcm {

/// Light's way in a millisecond [m], the unit of MSM's ranges.
inline constexpr double kMillisecond_m = geodesy::kSpeedOfLight * 1e-3;

/// The i-th has messages 1071 + 10 i (MSM1) to 1077 + 10 i (MSM7).
inline constexpr std::array kMsmSystems{gnss::System::GPS,  gnss::System::GLONASS, gnss::System::Galileo,
                                        gnss::System::SBAS, gnss::System::QZSS,    gnss::System::BeiDou};

/// Place in the mask of satellites (DF394), 1 to 64; 0: none.
[[nodiscard]] int mask_number(gnss::SatelliteId id);
/// The satellite of a place in the mask, 1 to 64; empty for reserved ones.
[[nodiscard]] std::optional<gnss::SatelliteId> satellite_at(gnss::System system, int place);

/// RINEX code of a place in the mask of signals (DF395), 1 to 32: "1C"; empty for reserved ones.
[[nodiscard]] std::string_view rinex_code(gnss::System system, int place);

/// DF407 (table 3.5-75: 0 to 704) or, not extended, DF402 (table 3.5-74: 0 to 15) of a phase that has been
/// continuous for so long [s], >= 0.
[[nodiscard]] int lock_time_indicator(double seconds, bool extended);
/// The least lock time [ms] of an indicator: DF402 (table 3.5-74, 0 to 15) or DF407 (0 to 704). The time of
/// the next indicator ends the times of this one.
[[nodiscard]] double least_lock_ms(int indicator, bool extended);

}  // namespace canyon::rtcm
