#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "canyon/base/record_notes.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {

/// A path of a GPX or KML file.
struct TrackFile {
  std::vector<geodesy::Geodetic> places;  ///< at least one; heights as the file has them, 0 where it has none
  std::vector<geodesy::GpsTime> times;    ///< one for each place; empty where the file has none
  std::vector<int> lines;                 ///< of the file, one for each place
  RecordNotes notes;
};

/// "gpx": the points of all tracks, else of all routes (GPX 1.0 and 1.1). "kml": all gx:Tracks with their
/// times, else the coordinates of the first LineString. Segments are put in order of time. Heights are above
/// sea level by the formats' definitions: a point's `geoidheight` is added, else `heights`' undulation, else
/// they are taken as ellipsoidal, with a warning (so are KML's unless its altitudeMode is absolute). A point
/// without a height gets that of the point before. Points with `<fix>none</fix>` and those without a time
/// among timed ones, and those with a number or time that is not valid, are left out and counted, as are
/// gx:Tracks whose times and places differ in number; times that do not rise stay (recorded_path.hpp). Throws
/// InputError with file and line for text that is not such a file, and where only half of the points or fewer
/// are valid or have a time.
[[nodiscard]] TrackFile read_track_file(const std::filesystem::path& path, const std::string& format,
                                        const HeightReading& heights = {});

/// The path of a track with times.
[[nodiscard]] TrajectoryFile timed_trajectory(TrackFile track);

/// Whether read_track_file() reads this format.
[[nodiscard]] bool is_track_format(const std::string& format);

}  // namespace canyon::simulation
