#pragma once

#include <filesystem>
#include <string>

#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::rinex {

/// Writes RINEX 3.04, mixed, all records in order of satellite and time, completely or not at all. 13
/// significant digits: records read from RINEX are restored exactly, computed ones within 0.1 mm and 1e-15 s;
/// ionosphere coefficients have 5 digits. 3.04 has no field for GLONASS's L2 delay. Throws InputError for
/// values that RINEX cannot represent: not finite, reference times off the whole second.
void write_rinex_navigation(const std::filesystem::path& path, const gnss::NavigationData& data);
[[nodiscard]] std::string format_rinex_navigation(const gnss::NavigationData& data);

}  // namespace canyon::rinex
