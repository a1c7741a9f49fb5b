#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/gps_time.hpp"

namespace canyon::simulation {

/// Positions that a receiver reported.
struct NmeaFixes {
  std::vector<std::pair<geodesy::GpsTime, geodesy::Geodetic>> fixes;  ///< in order of time, at least one
  bool has_own_dates = true;          ///< false: the file has times of day, dates are from `start`
  std::vector<std::string> warnings;  ///< skipped lines, counted by reason
};
/// GGA sentences with a fix, dated by RMC or ZDA, else by `start`. Throws InputError as read_trajectory()
/// does.
[[nodiscard]] NmeaFixes read_nmea_fixes(const std::filesystem::path& path, geodesy::GpsTime start);
/// The place that one GGA sentence reports; empty for another sentence, a damaged one, and one without a fix.
[[nodiscard]] std::optional<geodesy::Geodetic> position_of_gga(std::string_view line);

}  // namespace canyon::simulation
