#pragma once

#include <filesystem>
#include <string>

#include "canyon/run/motion/recorded_path.hpp"

namespace canyon::simulation {

/// "gpx": the points of all tracks, else of all routes (GPX 1.0 and 1.1). "kml": all gx:Tracks with their
/// times, else the Points of Placemarks with a time (TimeStamp, or the begin of a TimeSpan), else the
/// coordinates of the first LineString and of those that continue it; timed Points, times and LineStrings
/// that are not read are losses. Segments are put in order of time. Heights are above sea level by the
/// formats' definitions: a point's `geoidheight` is added, else `heights`' undulation, else they are taken as
/// ellipsoidal, with a note (so are KML's unless its altitudeMode is absolute). A point without a height gets
/// that of the point before. Points with `<fix>none</fix>`, points without a time among timed ones, and those
/// with a number or time that is not valid are left out and counted, as are gx:Tracks whose times and places
/// differ in number. Throws InputError with file and line for text that is not such a file, and where only
/// half of the points or fewer are valid or have a time.
[[nodiscard]] RecordedPath read_track_file(const std::filesystem::path& path, const std::string& format,
                                           const HeightReading& heights = {});

/// The path of the "Fix" lines of a text log of Android's GnssLogger: those of the provider GPS, else fused,
/// else network, with a warning. Times are UTC, heights above the ellipsoid, as android.location.Location has
/// them. Lines with values that are missing, no numbers or out of range are left out and counted. Throws
/// InputError for a log without a usable line.
[[nodiscard]] RecordedPath read_android_fixes(const std::filesystem::path& path,
                                              const HeightReading& heights);

}  // namespace canyon::simulation
