#pragma once

#include <filesystem>
#include <string>

#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::rinex {

/// Writes RINEX 3.04, mixed, all records in order of satellite and time. Whole or not at all. 13 significant
/// digits: records that came from RINEX come back exactly, computed ones within 0.1 mm and 1e-15 s;
/// ionosphere coefficients have 5 digits. GLONASS's L2 delay has no place in 3.04.
/// Throws InputError for what RINEX cannot hold: not finite, reference times off the whole second.
void write_rinex_navigation(const std::filesystem::path& path, const gnss::NavigationData& data);
[[nodiscard]] std::string format_rinex_navigation(const gnss::NavigationData& data);

}  // namespace canyon::rinex
