#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "canyon/simulation/motion/recorded_path.hpp"

namespace canyon::simulation {

/// "nmea": GGA sentences with a fix, or GNS if the log has more of these; without any RMC, else GLL. Dates
/// are those of valid RMC sentences, else of ZDA, else of `start`. A sentence ends with its checksum,
/// whatever a logger writes before '$' and after the checksum. In a log with checksums, sentences without one
/// are damaged. `heights` applies to altitudes without a separation.
[[nodiscard]] RecordedPath read_nmea(const std::filesystem::path& path, geodesy::GpsTime start,
                                     const HeightReading& heights = {});
/// The position of one GGA sentence; empty if the sentence is of another type, damaged or without a fix.
[[nodiscard]] std::optional<geodesy::Geodetic> position_of_gga(std::string_view line);

}  // namespace canyon::simulation
