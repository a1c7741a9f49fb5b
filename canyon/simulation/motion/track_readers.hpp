#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"

namespace canyon::simulation {

/// "gpx": the points of all tracks, else of all routes (GPX 1.0 and 1.1). "kml": all gx:Tracks with their
/// times, else the coordinates of the first LineString. Segments are put in order of time. Heights are above
/// sea level by the formats' definitions: a point's `geoidheight` is added, else `heights`' undulation, else
/// they are taken as ellipsoidal, with a note (so are KML's unless its altitudeMode is absolute). A point
/// without a height gets that of the point before. Points with `<fix>none</fix>`, points without a time among
/// timed ones, and those with a number or time that is not valid are left out and counted, as are gx:Tracks
/// whose times and places differ in number. Throws InputError with file and line for text that is not such a
/// file, and where only half of the points or fewer are valid or have a time.
[[nodiscard]] RecordedPath read_track_file(const std::filesystem::path& path, const std::string& format,
                                           const HeightReading& heights = {});

/// The path of the "Fix" lines of a text log of Android's GnssLogger: those of the provider GPS, else fused,
/// else network, with a warning. Times are UTC, heights above the ellipsoid, as android.location.Location has
/// them. Lines with values that are missing, no numbers or out of range are left out and counted. Throws
/// InputError for a log without a usable line.
[[nodiscard]] RecordedPath read_android_fixes(const std::filesystem::path& path,
                                              const HeightReading& heights);

/// Files of columns: CSV, solutions of RTKLIB, truth of the UrbanNav data sets.
/// "csv". The first line that is neither blank nor a comment (#) names the columns; commas, semicolons or
/// tabs separate, whichever stands in it. Names are those of a quantity, with a unit behind or without:
/// latitude, latitude_deg, latitude [rad] (docs/scenario.md has all). @param columns a quantity -> the name
/// that a column has in the file, with a unit in brackets where it names none ("lat [rad]"), or its number
/// from 1 in a file without a header ("2 [rad]")
[[nodiscard]] RecordedPath read_csv(TextFile& file, geodesy::GpsTime start, const HeightReading& heights,
                                    const TrajectoryColumns& columns);

/// "rtklib": a solution file (.pos) of places, with blanks or commas between; times are dates or weeks of
/// GPST, UTC or JST, places latitude and longitude (also in degrees, minutes and seconds) and height, or
/// ECEF. Source: RTKLIB manual 2.4.2, appendix B.1.
[[nodiscard]] RecordedPath read_rtklib(TextFile& file, const HeightReading& heights);
/// Whether the first comments are those of such a file.
[[nodiscard]] bool is_rtklib(const std::filesystem::path& path);

/// "urbannav": GPS week, time of week, latitude, longitude, height with commas between; or, of 2021, UNIX
/// time, week, time of week, latitude and longitude in degrees, minutes and seconds, and height with blanks.
[[nodiscard]] RecordedPath read_urbannav(TextFile& file);
/// Whether the first line that is no comment is one of such a file.
[[nodiscard]] bool is_urbannav(const std::filesystem::path& path);

/// A quantity that read_csv() knows a column of.
struct CsvQuantity {
  std::string_view name, help;
};
[[nodiscard]] std::vector<CsvQuantity> csv_quantities();

/// "nmea": GGA sentences with a fix, or GNS, where the log has more of these; without any RMC, else GLL.
/// Dates are those of valid RMC sentences, else of ZDA, else of `start`. A sentence ends with its checksum,
/// whatever a logger writes before '$' and behind; in a log with checksums those without one are damaged.
/// Altitudes without a separation are taken by `heights`.
[[nodiscard]] RecordedPath read_nmea(const std::filesystem::path& path, geodesy::GpsTime start,
                                     const HeightReading& heights = {});
/// The place that one GGA sentence reports; empty for another sentence, a damaged one, and one without a fix.
[[nodiscard]] std::optional<geodesy::Geodetic> position_of_gga(std::string_view line);

}  // namespace canyon::simulation
