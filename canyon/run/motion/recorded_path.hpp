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
#include "canyon/run/motion/trajectory.hpp"

namespace canyon::simulation {

/// What the readers of recorded paths share.
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

/// Leaves out and counts the fewest points without which times rise, and those more than a year from most
/// others. Throws InputError where that are more than half of all points.
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

/// A record that has no place or no time, or a value that stands for none, as before a fix. However many
/// there are, the file is no other one.
class NoValue : public InputError {
  using InputError::InputError;
};
/// Calls `read`; a record that it refuses is left out and is a loss, by NoValue one that is dropped.
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

/// Whether a field holds no value: it is empty, "nan" or the like, or a number that stands for none (-9999,
/// -32768).
[[nodiscard]] bool is_missing(std::string_view text);
/// A field as a number; a comma counts as the decimal point.
[[nodiscard]] std::optional<double> number_of(std::string_view text);
/// The same, or an InputError that names `what`, NoValue for a text that stands for none.
[[nodiscard]] double to_number(const RecordAt& at, std::string_view text, std::string_view what);
/// Whether it is latitude 0, longitude 0, which receivers and autopilots state before a fix.
[[nodiscard]] constexpr bool is_nowhere(double latitude_deg, double longitude_deg) {
  return latitude_deg == 0 && longitude_deg == 0;
}
/// Degrees as a place of height 0; an InputError for values beyond 90 and 180 deg, NoValue for nowhere.
[[nodiscard]] geodesy::Geodetic place_of(const RecordAt& at, double latitude_deg, double longitude_deg);
/// Whether this may be the distance of a vehicle from the Earth's centre [m].
[[nodiscard]] constexpr bool is_radius(double radius_m) {
  return radius_m > 6.3e6 && radius_m < 8e6;
}
/// A place by ECEF [m]; an InputError where no vehicle can be, NoValue for the Earth's centre.
[[nodiscard]] geodesy::Geodetic place_of(const RecordAt& at, const Eigen::Vector3d& ecef);
/// The same time; NoValue before 1981: clocks that were never set state 1970 and 1980.
[[nodiscard]] geodesy::GpsTime set_time(const RecordAt& at, geodesy::GpsTime time);
/// An instant by the full GPS week and the seconds in it, as set_time(); an InputError for a fraction of a
/// week, weeks from 10,000 on, and seconds out of the week.
[[nodiscard]] geodesy::GpsTime time_of_week(const RecordAt& at, double week, double tow_s);
/// parse_simulated_time() and set_time(), with a note where the text names no zone and an InputError at the
/// record's line.
[[nodiscard]] geodesy::GpsTime time_of_text(const RecordAt& at, std::string_view text);
/// Adds the city's undulation to a height above sea level and notes it. @param of "height above sea level"
[[nodiscard]] double from_sea_level(const RecordAt& at, double height_m, std::string_view of,
                                    const HeightReading& heights);

}  // namespace canyon::simulation
