#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/read_report.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

// Common parts of the readers of recorded paths.
namespace canyon::simulation {

struct RecordedPoint {
  geodesy::GpsTime time;
  geodesy::Geodetic position;
  int line = 0;  ///< of its file
};
/// In the order of a file.
using RecordedPoints = std::vector<RecordedPoint>;

/// The positions of a file.
struct RecordedPath {
  RecordedPoints points;  ///< at least one
  bool timed = true;      ///< false: the file has no times
  bool is_dated = true;   ///< false: its times are relative to `start`
  ReadReport report;
};

/// Reads a file of any format; points whose times do not increase are kept. Parameters and errors are those
/// of read_trajectory_file(), which rejects a path without times.
[[nodiscard]] RecordedPath read_recorded_path(const std::filesystem::path& path, const std::string& format,
                                              geodesy::GpsTime start, const HeightReading& heights = {},
                                              const TrajectoryColumns& columns = {});

/// Removes and counts the fewest points such that times increase, and points more than a year from most
/// others. Throws InputError if more than half of all points would be removed.
void drop_unordered(RecordedPath& path);

/// The trajectory through points with times after drop_unordered(), with a note about pauses.
[[nodiscard]] TrajectoryFile recorded_trajectory(RecordedPath path);

/// "trajectory.columns: {...}": hint how to name the columns of a CSV file.
[[nodiscard]] std::string_view columns_hint();

/// The line of a file that is being read.
struct RecordAt {
  ReadReport& report;
  int line = 0;

  [[nodiscard]] InputError error(std::string_view problem, std::string_view hint = {}) const {
    return {report.path(), line, problem, hint};
  }
};

/// A record without position or time, or with a no-data value, as before a fix. Such records, however many,
/// do not make the file invalid.
class NoValue : public InputError {
  using InputError::InputError;
};
/// Calls `read`. A record that it rejects is skipped and counted as lost; after NoValue as dropped.
template <typename Read>
void guard_record(ReadReport& report, const Read& read) {
  report.guard([&] {
    try {
      read();
    } catch (const NoValue& none) {
      report.drop(none);
    }
  });
}

/// Whether a field holds no value: it is empty, "nan" or the like, or a no-data number (-9999, -32768).
[[nodiscard]] bool is_missing(std::string_view text);
/// A field as a number; a comma counts as the decimal point.
[[nodiscard]] std::optional<double> number_of(std::string_view text);
/// number_of(), or an InputError that names `what`; NoValue for a no-data text.
[[nodiscard]] double to_number(const RecordAt& at, std::string_view text, std::string_view what);
/// Whether it is latitude 0, longitude 0, which receivers and autopilots report before a fix.
[[nodiscard]] constexpr bool is_null_island(double latitude_deg, double longitude_deg) {
  return latitude_deg == 0 && longitude_deg == 0;
}
/// Degrees as a position of height 0; InputError beyond 90 and 180 deg, NoValue if is_null_island().
[[nodiscard]] geodesy::Geodetic position_of(const RecordAt& at, double latitude_deg, double longitude_deg);
/// Whether this is a possible distance of a vehicle from the Earth's centre [m].
[[nodiscard]] constexpr bool is_radius(double radius_m) {
  return radius_m > 6.3e6 && radius_m < 8e6;
}
/// A position from ECEF [m]; an InputError if not is_radius(), NoValue for the Earth's centre.
[[nodiscard]] geodesy::Geodetic position_of(const RecordAt& at, const Eigen::Vector3d& ecef);
/// Returns `time`; NoValue before 1981: clocks that were never set report 1970 and 1980.
[[nodiscard]] geodesy::GpsTime set_time(const RecordAt& at, geodesy::GpsTime time);
/// An instant by the full GPS week and the seconds in it, checked by set_time(); an InputError for a fraction
/// of a week, weeks from 10,000 on, and seconds outside the week.
[[nodiscard]] geodesy::GpsTime time_of_week(const RecordAt& at, double week, double tow_s);
/// parse_simulated_time() and set_time(); a note if it has no time zone, an InputError at the record's line.
[[nodiscard]] geodesy::GpsTime time_of_text(const RecordAt& at, std::string_view text);
/// Adds the city's undulation to a height above sea level and notes it. @param of "height above sea level"
[[nodiscard]] double from_sea_level(const RecordAt& at, double height_m, std::string_view of,
                                    const HeightReading& heights);

}  // namespace canyon::simulation
