#pragma once

#include <filesystem>
#include <set>
#include <vector>

#include "canyon/base/text_file.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::rinex {

/// Reads a RINEX navigation file: 2.x (GPS "N", GLONASS "G", SBAS "H", Galileo "E" or "L", QZSS "J"), 3.x,
/// and 4.00 for records of the same messages (LNAV, INAV, FNAV, D1, D2, FDMA, SBAS). Plain or gzip. GPS,
/// Galileo, BeiDou, GLONASS, QZSS, SBAS; other systems and record types are counted, with one remark per
/// kind. A damaged record is a loss with file and line; only this record is skipped. GLONASS and SBAS records
/// have no week: a few that are dated days from all others of the file are skipped as well; of many the first
/// twenty are named and the rest counted. GLONASS epochs are UTC, with the leap seconds of
/// geodesy::leap_seconds(), not the header's. Truncated gzip data are read up to the cut, with a warning.
/// Throws InputError if the file is not a RINEX navigation file or has no usable record.
/// @param wanted systems whose damaged records are losses; for others they are remarks; empty: all
[[nodiscard]] gnss::NavigationData read_rinex_navigation(const std::filesystem::path& path,
                                                         const std::set<gnss::System>& wanted = {});
[[nodiscard]] gnss::NavigationData read_rinex_navigation(TextFile file,
                                                         const std::set<gnss::System>& wanted = {});
/// Several files, merged.
[[nodiscard]] gnss::NavigationData read_rinex_navigation(const std::vector<std::filesystem::path>& paths,
                                                         const std::set<gnss::System>& wanted = {});

}  // namespace canyon::rinex
