#pragma once

#include <filesystem>

#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {

/// The path of the "Fix" lines of a text log of Android's GnssLogger: those of the provider GPS, else fused,
/// else network, with a warning. Times are UTC, heights above the ellipsoid, as android.location.Location has
/// them. Lines with values that are missing, no numbers or out of range are left out and counted. Throws
/// InputError for a log without a usable line.
[[nodiscard]] TrajectoryFile read_android_fixes(const std::filesystem::path& path,
                                                const HeightReading& heights);

}  // namespace canyon::simulation
