#pragma once

#include <filesystem>
#include <string>

#include "canyon/simulation/motion/recorded_path.hpp"

namespace canyon::simulation {

/// "gpx": the points of all tracks, else of all routes (GPX 1.0 and 1.1). "kml": all gx:Tracks with their
/// times, else the Points of Placemarks with a time (TimeStamp, or the begin of a TimeSpan), else the
/// coordinates of the first LineString and of those that continue it; timed Points, times and LineStrings
/// that are not read are counted as lost. Segments are sorted by time. Heights are above sea level by the
/// formats' definitions: a point's `geoidheight` is added, else the undulation of `heights`, else they are
/// taken as ellipsoidal, with a note (KML's also, unless altitudeMode is absolute). A point without a height
/// gets the height of the previous point. These are left out and counted: points with `<fix>none</fix>`,
/// points without a time among timed ones, points with an invalid number or time, and gx:Tracks with
/// different numbers of times and positions. Throws InputError with file and line if the text is not such a
/// file, or if at most half of the points are valid or have a time.
[[nodiscard]] RecordedPath read_track_file(const std::filesystem::path& path, const std::string& format,
                                           const HeightReading& heights = {});

/// The path of the "Fix" lines of a text log of Android's GnssLogger: those of the provider GPS, else fused,
/// else network, with a warning. Times are UTC, heights above the ellipsoid, as in android.location.Location.
/// Lines with missing, non-numeric or out-of-range values are left out and counted. Throws InputError for a
/// log without a usable line.
[[nodiscard]] RecordedPath read_android_fixes(const std::filesystem::path& path,
                                              const HeightReading& heights);

}  // namespace canyon::simulation
