#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/gps_time.hpp"

namespace canyon::simulation {

/// A path of a GPX or KML file.
struct TrackFile {
  std::vector<geodesy::Geodetic> places;  ///< at least one; heights as the file has them, 0 where it has none
  std::vector<geodesy::GpsTime> times;    ///< one for each place, rising; empty where the file has none
  std::vector<std::string> warnings;
};

/// "gpx": the points of all tracks, else of all routes (GPX 1.0 and 1.1). "kml": gx:Track with its times,
/// else the coordinates of the first LineString. Their heights are above sea level by the formats'
/// definitions and are taken as they are, as heights above the ellipsoid; so say the warnings. Points whose
/// time does not follow the one before are left out, and counted. Throws InputError with file and line for
/// what is not such a file, for numbers and times that are none, and where only some points have a time.
[[nodiscard]] TrackFile read_track_file(const std::filesystem::path& path, const std::string& format);

/// Whether read_track_file() reads this format.
[[nodiscard]] bool is_track_format(const std::string& format);

}  // namespace canyon::simulation
