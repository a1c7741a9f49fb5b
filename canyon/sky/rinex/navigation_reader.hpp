#pragma once

#include <filesystem>
#include <set>
#include <vector>

#include "canyon/base/text_file.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::rinex {

/// Reads a RINEX navigation file: 2.x (GPS "N", GLONASS "G", SBAS "H", Galileo "E" or "L", QZSS "J"), 3.x,
/// and 4.00 where the record is the same message (LNAV, INAV, FNAV, D1, D2, FDMA, SBAS). Plain or gzip. GPS,
/// Galileo, BeiDou, GLONASS, QZSS, SBAS; other systems and record types are counted, a remark for each kind
/// of record. A damaged record is a loss with file and line and is left out alone, and so are few records of
/// GLONASS and SBAS, which have no week, that are dated days from all others of the file; of many the first
/// twenty are named and the rest counted. GLONASS epochs are UTC, with the leap seconds of
/// geodesy::leap_seconds(), not the header's. Gzip data that end early are read up to there, with a warning.
/// Throws InputError where the file is not RINEX navigation file or holds no usable record.
/// @param wanted systems whose damaged records are losses, those of others are remarks; empty: all
[[nodiscard]] gnss::NavigationData read_rinex_navigation(const std::filesystem::path& path,
                                                         const std::set<gnss::System>& wanted = {});
[[nodiscard]] gnss::NavigationData read_rinex_navigation(TextFile file,
                                                         const std::set<gnss::System>& wanted = {});
/// Several files, merged.
[[nodiscard]] gnss::NavigationData read_rinex_navigation(const std::vector<std::filesystem::path>& paths,
                                                         const std::set<gnss::System>& wanted = {});

}  // namespace canyon::rinex
