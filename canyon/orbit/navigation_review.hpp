#pragma once

#include <filesystem>
#include <vector>

#include "canyon/gnss/navigation_data.hpp"

namespace canyon::orbit {

/// RINEX navigation files as one, reviewed. Throws InputError as rinex::read_rinex_navigation() does.
[[nodiscard]] gnss::NavigationData read_navigation(const std::vector<std::filesystem::path>& paths);

/// Leaves out the records that contradict the others of their satellite: each is compared with the two before
/// and the two behind it, midway between the two reference times. One whose position (some 100 m in two
/// hours, growing with the time between) or clock (0.2 us) agrees with none of them, while these agree with
/// others, is left out with a warning. Two that contradict each other and have no third stay, with a warning.
/// GLONASS records whose orbit is not in the plane of their slot are left out first: some of a file, whose
/// time or number is wrong, or most of it, where they are off by the three hours of Moscow. Most of a file
/// off by another angle stay, with a warning: it may be of a simulated constellation. Throws InputError where
/// nothing is left.
/// Unhealthy records are not compared: they say that the satellite is not to be used.
/// @param sources for warnings, instead of the names in data.sources
void review_navigation(gnss::NavigationData& data, const std::vector<std::filesystem::path>& sources = {});

}  // namespace canyon::orbit
