// Declared in canyon/simulation/motion/trajectory.hpp.
// read_trajectory() (trajectory.hpp), and the reader of UrbanNav's truth files.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/simulation/motion/android_fixes.hpp"
#include "canyon/simulation/motion/column_points.hpp"
#include "canyon/simulation/motion/nmea_fixes.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"
#include "canyon/simulation/motion/track_file.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {
namespace {

using geodesy::GpsTime;

// "22 18 04.31949" in degrees; the sign of the degrees is that of all three.
std::string degrees_of(const TextFile& file, std::string_view degrees, std::string_view minutes,
                       std::string_view seconds) {
  const double d = to_number(file, degrees, "degrees");
  const double m = to_number(file, minutes, "minutes"), s = to_number(file, seconds, "seconds");
  if (!(m >= 0 && m < 60 && s >= 0 && s < 60)) {
    throw file.error(
        fmt::format("'{} {} {}' are not degrees, minutes and seconds", degrees, minutes, seconds),
        "minutes and seconds run from 0 to 60");
  }
  return fmt::format("{:.12f}", std::copysign(std::abs(d) + m / 60 + s / 3600, degrees[0] == '-' ? -1 : 1));
}

/// The drives of 2021: UNIX time, week, time of week, two angles in degrees, minutes, seconds, height, ...
bool is_blank_separated(std::string_view line) {
  return line.find(',') == std::string_view::npos && split_blanks(line).size() >= 10;
}

void read_urbannav_line(const TextFile& file, std::string_view line, std::size_t columns,
                        ColumnPoints& points) {
  std::vector<std::string_view> fields = split(line, ',');
  std::string latitude, longitude;
  if (is_blank_separated(line)) {
    const auto words = split_blanks(line);
    latitude = degrees_of(file, words[3], words[4], words[5]);
    longitude = degrees_of(file, words[6], words[7], words[8]);
    fields = {words[1], words[2], latitude, longitude, words[9]};
  } else if (fields.size() < 5 || fields.size() != columns) {
    throw file.error(
        fmt::format("{} columns where {} are needed", fields.size(), std::max<std::size_t>(columns, 5)),
        "columns are GPS week, time of week, latitude, longitude, height");
  }
  const GpsTime time = time_of_week(file, fields[0], to_number(file, fields[1], "time of week"));
  points.add(time, {fields[2], fields[3], fields[4]}, false);
}

TrajectoryFile read_urbannav(TextFile& file, const HeightReading& heights) {
  RecordNotes notes(file.path());
  ColumnPoints points(file, heights, notes);
  bool first = true;
  std::size_t columns = 0;
  while (const auto line = file.next_line()) {
    if (is_skipped(*line)) continue;
    const std::vector<std::string_view> fields = split(*line, ',');
    if (std::exchange(first, false) && is_csv_header(fields)) continue;
    if (columns == 0) columns = fields.size();
    notes.guard([&] { read_urbannav_line(file, *line, columns, points); });
  }
  return points.take(true, "'GPS week, time of week, latitude, longitude, height'");
}

TrajectoryFile read_known_format(const std::filesystem::path& path, const std::string& format, GpsTime start,
                                 const HeightReading& heights) {
  if (is_track_format(format)) {
    TrackFile track = read_track_file(path, format, heights);
    if (track.times.empty()) {
      throw InputError(path, 0, "the path has no times", "name it in a scenario, with trajectory.speed_mps");
    }
    return timed_trajectory(std::move(track));
  }
  if (format == "gnsslogger") return read_android_fixes(path, heights);
  if (format == "nmea") {
    NmeaFixes nmea = read_nmea_fixes(path, start, heights);
    return recorded_trajectory(std::move(nmea.fixes), nmea.has_own_dates, std::move(nmea.notes));
  }
  TextFile file(path);
  return format == "csv" ? read_csv_track(file, start, heights) : read_urbannav(file, heights);
}

}  // namespace

const std::vector<std::string>& trajectory_formats() {
  static const std::vector<std::string> formats{"csv", "urbannav", "nmea", "gpx", "kml", "gnsslogger"};
  return formats;
}

TrajectoryFile read_trajectory_file(const std::filesystem::path& path, const std::string& format,
                                    GpsTime start, const HeightReading& heights) {
  if (std::find(trajectory_formats().begin(), trajectory_formats().end(), format) ==
      trajectory_formats().end()) {
    throw InputError(fmt::format("trajectory format '{}' is unknown", format),
                     fmt::format("it is one of {}", fmt::join(trajectory_formats(), ", ")));
  }
  return read_as(kind_of_trajectory(format), path,
                 [&] { return read_known_format(path, format, start, heights); });
}

Trajectory read_trajectory(const std::filesystem::path& path, const std::string& format, GpsTime start) {
  return read_trajectory_file(path, format, start).trajectory;
}

}  // namespace canyon::simulation
