#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/read_report.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

/// What the readers of recorded paths share.
namespace canyon::simulation {

/// A position with its time.
struct RecordedPoint {
  geodesy::GpsTime time;
  geodesy::Geodetic place;
  int line = 0;  ///< of its file
};
/// In the order of a file.
using RecordedPoints = std::vector<RecordedPoint>;

/// The positions of a file.
struct RecordedPath {
  RecordedPoints points;      ///< at least one
  bool timed = true;          ///< false: the file has no times
  bool has_own_dates = true;  ///< false: its times are relative to `start`
  ReadReport report;
};

/// Reads a file of any format; points whose times do not rise are still in it. Parameters and errors are
/// those of read_trajectory_file(), which refuses a path without times.
[[nodiscard]] RecordedPath read_recorded_path(const std::filesystem::path& path, const std::string& format,
                                              geodesy::GpsTime start, const HeightReading& heights = {},
                                              const TrajectoryColumns& columns = {});

/// Leaves out points whose time is not after the one before, and counts them. Throws InputError where that
/// are more than half of all points.
void keep_rising(RecordedPath& path);

/// The way through points with times after keep_rising(), with a note about pauses.
[[nodiscard]] TrajectoryFile recorded_trajectory(RecordedPath path);

/// "trajectory.columns: {...}": how a user names the columns of a CSV file.
[[nodiscard]] std::string_view columns_cure();

/// The line of a file that is read.
struct RecordAt {
  ReadReport& report;
  int line = 0;

  [[nodiscard]] InputError error(std::string_view problem, std::string_view cure = {}) const {
    return {report.path(), line, problem, cure};
  }
};

/// Whether a field holds no value: it is empty or "nan".
[[nodiscard]] bool is_missing(std::string_view text);
/// A field as a number; a comma counts as the decimal point.
[[nodiscard]] std::optional<double> number_of(std::string_view text);
/// The same, or an InputError that names `what`.
[[nodiscard]] double to_number(const RecordAt& at, std::string_view text, std::string_view what);
/// Degrees as a place of height 0; an InputError for values beyond 90 and 180 deg.
[[nodiscard]] geodesy::Geodetic place_of(const RecordAt& at, double latitude_deg, double longitude_deg);
/// An instant by the full GPS week and the seconds in it; an InputError for a fraction of a week, weeks from
/// 10,000 on, and seconds out of the week.
[[nodiscard]] geodesy::GpsTime time_of_week(const RecordAt& at, double week, double tow_s);
/// parse_simulated_time(), with a note where the text names no zone and an InputError at the record's line.
[[nodiscard]] geodesy::GpsTime time_of_text(const RecordAt& at, std::string_view text);
/// Adds the city's undulation to a height above sea level and notes it. @param of "height above sea level"
[[nodiscard]] double from_sea_level(const RecordAt& at, double height_m, std::string_view of,
                                    const HeightReading& heights);

}  // namespace canyon::simulation
