#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "canyon/run/motion/recorded_path.hpp"

namespace canyon::simulation {

/// "nmea": GGA sentences with a fix, or GNS, where the log has more of these; without any RMC, else GLL.
/// Dates are those of valid RMC sentences, else of ZDA, else of `start`. A sentence ends with its checksum,
/// whatever a logger writes before '$' and behind; in a log with checksums those without one are damaged.
/// Altitudes without a separation are taken by `heights`.
[[nodiscard]] RecordedPath read_nmea(const std::filesystem::path& path, geodesy::GpsTime start,
                                     const HeightReading& heights = {});
/// The place that one GGA sentence reports; empty for another sentence, a damaged one, and one without a fix.
[[nodiscard]] std::optional<geodesy::Geodetic> position_of_gga(std::string_view line);

}  // namespace canyon::simulation
