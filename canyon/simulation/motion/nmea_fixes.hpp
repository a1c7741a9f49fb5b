#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {

/// Positions that a receiver reported.
struct NmeaFixes {
  RecordedPoints fixes;       ///< in order of time, at least one
  bool has_own_dates = true;  ///< false: the file has times of day, dates are from `start`
  RecordNotes notes;
};
/// GGA sentences with a fix, dated by valid RMC sentences, else by ZDA, else by `start`. A sentence ends with
/// its checksum, whatever a logger writes before '$' and behind; in a log with checksums those without one
/// are damaged. The first of several sentences of one instant (several talkers) counts; a date that
/// contradicts those around it does not. Altitudes without a separation are taken by `heights`. Throws
/// InputError as read_trajectory() does.
[[nodiscard]] NmeaFixes read_nmea_fixes(const std::filesystem::path& path, geodesy::GpsTime start,
                                        const HeightReading& heights = {});
/// The place that one GGA sentence reports; empty for another sentence, a damaged one, and one without a fix.
[[nodiscard]] std::optional<geodesy::Geodetic> position_of_gga(std::string_view line);

}  // namespace canyon::simulation
