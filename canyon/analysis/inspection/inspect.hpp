#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/read_report.hpp"

namespace canyon::inspection {

/// The contents of a file of any kind, as read by Canyon's readers.
struct FileReport {
  std::string kind;                                           ///< "RINEX 3.03 observations"
  std::vector<std::pair<std::string, std::string>> contents;  ///< names and values, for people
  ReadReport notes;                                           ///< records left out, assumptions, and remarks
  std::vector<std::string> uses;                              ///< keys and options that accept the file
};

/// Reads a whole file by the reader for its content (for cities and scenarios: for its name): scenarios,
/// cities, navigation and observation files of RINEX, SP3, RTCM 3, logs of Android's GnssLogger, recorded
/// paths (NMEA, GPX, KML, CSV), heat maps and results of studies. Part of canyon::io. Throws InputError, with
/// the reader's message, for a file that none of them can read.
[[nodiscard]] FileReport inspect_file(const std::filesystem::path& path);

}  // namespace canyon::inspection
