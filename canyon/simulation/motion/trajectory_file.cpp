// Declared in canyon/simulation/motion/trajectory.hpp.
// read_trajectory() (trajectory.hpp), and the readers of CSV and UrbanNav's truth files.
#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <utility>

#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/geodesy/time_text.hpp"
#include "canyon/simulation/motion/android_fixes.hpp"
#include "canyon/simulation/motion/nmea_fixes.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"
#include "canyon/simulation/motion/track_file.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;
using namespace std::string_literals;

/// A field as a number; a comma counts as the decimal point where it does not separate columns.
std::optional<double> field_number(std::string_view text) {
  const std::size_t comma = text.find(',');
  if (comma == std::string_view::npos) return parse_double(text);
  std::string with_point(text);
  with_point[comma] = '.';
  return parse_double(with_point);
}

double to_number(const TextFile& file, std::string_view text, std::string_view what) {
  const std::optional<double> value = field_number(text);
  if (!value) throw file.error(fmt::format("the {} '{}' is not a number", what, trim(text)));
  return *value;
}

// NMEA writes degrees and minutes in one number, ddmm.mmmm.
bool looks_like_degrees_and_minutes(double value, double limit_deg) {
  const double degrees = std::trunc(std::abs(value) / 100);
  const double minutes = std::abs(value) - 100 * degrees;
  return degrees >= 1 && degrees <= limit_deg && minutes < 60;
}

/// Whether three numbers are a place near the ground in ECEF [m].
bool looks_like_ecef(double x, double y, double z) {
  const double norm_m = std::hypot(x, y, z);
  return norm_m > 6.3e6 && norm_m < 6.5e6 && (std::abs(x) > 360 || std::abs(y) > 360);
}

double to_angle_deg(const TextFile& file, std::string_view text, std::string_view what, double limit_deg) {
  const double value = to_number(file, text, what);
  if (std::abs(value) <= limit_deg) return value;
  const std::string problem = fmt::format("the {} {} deg is out of range", what, trim(text));
  if (looks_like_degrees_and_minutes(value, limit_deg)) {
    throw file.error(
        problem,
        fmt::format(
            "it looks like NMEA's ddmm.mm (degrees and minutes): write {:.7f}",
            std::copysign(std::trunc(std::abs(value) / 100) + std::fmod(std::abs(value), 100) / 60, value)));
  }
  if (std::abs(value) >= 1e6 && std::abs(value) <= limit_deg * 1e7) {
    throw file.error(problem, "it looks like degrees times 1e7: divide");
  }
  throw file.error(problem,
                   fmt::format("it runs from -{0} to {0} deg; check the order of the columns", limit_deg));
}

using Coordinates = std::array<std::string_view, 3>;
constexpr std::array<std::string_view, 3> kGeodeticNames{"latitude", "longitude", "height"};

/// Latitude and longitude [deg] and height [m].
Geodetic geodetic_place(const TextFile& file, const Coordinates& text) {
  const auto& [latitude, longitude, height] = text;
  const std::optional<double> first = field_number(latitude);
  const std::optional<double> second = field_number(longitude);
  const std::optional<double> third = field_number(height);
  if (first && second && third && looks_like_ecef(*first, *second, *third)) {
    throw file.error(fmt::format("the latitude {} deg is out of range", trim(latitude)),
                     "these are ECEF x, y, z in metres: use format csv, and name the columns time, x, y, z");
  }
  // No latitude, but a longitude beside a latitude: 114.17, 22.30. In ddmm.mm 114.17 would be 1 deg 14 min,
  // and the other one below a degree.
  if (first && second && std::abs(*first) > 90 && std::abs(*first) <= 180 && std::abs(*second) <= 90) {
    throw file.error(fmt::format("the latitude {} deg is out of range", trim(latitude)),
                     "latitude and longitude look swapped: latitude is first, or name the columns in a "
                     "header");
  }
  const double latitude_deg = to_angle_deg(file, latitude, "latitude", 90);
  double longitude_deg = to_number(file, longitude, "longitude");
  // 0 to 360 is a habit of some recorders.
  if (longitude_deg > 180 && longitude_deg <= 360) {
    longitude_deg -= 360;
  } else {
    longitude_deg = to_angle_deg(file, longitude, "longitude", 180);
  }
  const double height_m = to_number(file, height, "height");
  if (height_m < -10e3 || height_m > 100e6) {
    throw file.error(fmt::format("the height {} m is out of range", trim(height)),
                     "it is metres above the ellipsoid");
  }
  return Geodetic::from_degrees(latitude_deg, longitude_deg, height_m);
}

Geodetic ecef_place(const TextFile& file, const Coordinates& text) {
  const Eigen::Vector3d ecef(to_number(file, text[0], "x"), to_number(file, text[1], "y"),
                             to_number(file, text[2], "z"));
  if (!(ecef.norm() > 6.3e6 && ecef.norm() < 106e6)) {
    throw file.error(fmt::format("x, y, z are {:.0f} m from the Earth's centre", ecef.norm()),
                     "they are ECEF coordinates in metres; waypoints may be east_m, north_m, up_m");
  }
  return geodesy::geodetic_from_ecef(ecef);
}

/// The points of a file of columns. A line without a position is left out and counted.
class ColumnPoints {
 public:
  ColumnPoints(const TextFile& file, const HeightReading& heights) : file_(file), heights_(heights) {}

  /// `ecef`: the coordinates are x, y, z; else latitude, longitude and height.
  void add(GpsTime time, Coordinates text, bool ecef) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (!is_missing(text[k])) continue;
      if (k == 2 && !ecef && !heights_.needed) {
        text[k] = points_.empty() ? "0" : std::string_view(last_height_);
        break;
      }
      ++missing_;
      if (!first_missing_) {
        first_missing_ = file_.error(fmt::format("the {} '{}' is not a number",
                                                 ecef ? "xyz"s.substr(k, 1) : std::string(kGeodeticNames[k]),
                                                 trim(text[k])));
      }
      return;
    }
    points_.emplace_back(time, ecef ? ecef_place(file_, text) : geodetic_place(file_, text));
    last_height_ = text[2];
  }
  void skip_missing() { ++missing_; }
  void skip_damaged() { ++damaged_; }
  [[nodiscard]] bool empty() const { return points_.empty(); }

  /// Throws where there are none. `expected` describes a line.
  [[nodiscard]] TrajectoryFile take(bool has_own_dates, FileNotes notes, std::string_view expected) {
    if (points_.empty()) {
      if (first_missing_) throw *first_missing_;
      throw InputError(file_.path(), 0, "no position in it", fmt::format("expected lines of {}", expected));
    }
    notes.say(missing_, "lines without a time or a position are left out");
    notes.say(damaged_, "lines are cut short and left out");
    return recorded_trajectory(std::move(points_), has_own_dates, std::move(notes));
  }

 private:
  const TextFile& file_;
  HeightReading heights_;
  RecordedPoints points_;
  std::string last_height_;
  std::size_t missing_ = 0, damaged_ = 0;
  std::optional<InputError> first_missing_;
};

bool is_skipped(std::string_view line) {
  line = trim(line);
  return line.empty() || line.front() == '#';
}

// --- csv ---------------------------------------------------------------------------------------------------

constexpr std::string_view kCsvColumns = "'time, latitude, longitude, height'";

struct CsvColumns {
  char separator = ',';
  std::array<std::size_t, 4> index{0, 1, 2, 3};  // time and three coordinates
  std::size_t needed = 4;
  bool ecef = false;
};

/// The separator of a file by its first line: commas may be decimal points where there are enough semicolons
/// or tabs.
char separator_of(std::string_view line) {
  for (const char separator : {';', '\t'})
    if (std::count(line.begin(), line.end(), separator) >= 3) return separator;
  return ',';
}

/// Fields of a line by RFC 4180, without blanks and quotes around them.
std::vector<std::string_view> csv_fields(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  bool quoted = false;
  std::size_t begin = 0;
  for (std::size_t at = 0; at <= line.size(); ++at) {
    if (at < line.size() && line[at] == '"') quoted = !quoted;
    if (at < line.size() && (quoted || line[at] != separator)) continue;
    std::string_view field = trim(line.substr(begin, at - begin));
    if (field.size() >= 2 && field.front() == '"' && field.back() == '"')
      field = trim(field.substr(1, field.size() - 2));
    fields.push_back(field);
    begin = at + 1;
  }
  return fields;
}

bool is_csv_header(const std::vector<std::string_view>& fields) {
  // A data line has numbers for latitude and longitude; a broken number must not turn a line into a header.
  return !trim(fields.front()).empty() && std::none_of(fields.begin(), fields.end(), [](std::string_view f) {
    return parse_double(f).has_value();
  }) && std::isalpha(static_cast<unsigned char>(trim(fields.front()).front()));
}

/// The name of a column in lower case without its unit.
std::string column_name(const TextFile& file, std::string_view text) {
  std::string name = lower_case(trim(text));
  for (const std::string_view unit : {"_deg", "_m", "(deg)", "(m)", "[deg]", "[m]"}) {
    if (name.size() > unit.size() && name.ends_with(unit))
      name = std::string(trim(std::string_view(name).substr(0, name.size() - unit.size())));
  }
  if (name.size() > 4 && name.ends_with("_rad"))
    throw file.error(fmt::format("the column '{}' is in radians", trim(text)), "write degrees");
  return name;
}

void read_csv_header(const TextFile& file, const std::vector<std::string_view>& fields, CsvColumns& columns) {
  using Words = std::vector<std::string>;
  std::vector<std::string> names;
  for (const std::string_view field : fields) names.push_back(column_name(file, field));
  const auto find = [&](std::size_t k, const Words& words) {
    const auto at = std::find_first_of(names.begin(), names.end(), words.begin(), words.end());
    if (at == names.end()) return false;
    columns.index[k] = static_cast<std::size_t>(at - names.begin());
    return true;
  };
  const auto require = [&](std::size_t k, std::string_view name, const Words& words) {
    if (find(k, words)) return;
    throw file.error(fmt::format("the header has no column '{}'", name),
                     "name the columns time, latitude, longitude, height, or time, x, y, z (ECEF); commas, "
                     "semicolons or tabs between");
  };
  require(0, "time", {"time", "timestamp", "t", "time_s", "utc", "gpst"});
  columns.ecef = !find(1, {"latitude", "lat"}) && find(1, {"x", "ecef_x", "x_ecef"}) &&
                 find(2, {"y", "ecef_y", "y_ecef"}) && find(3, {"z", "ecef_z", "z_ecef"});
  if (!columns.ecef) {
    require(1, "latitude", {"latitude", "lat"});
    require(2, "longitude", {"longitude", "lon", "lng", "long"});
    require(3, "height", {"height", "h", "alt", "altitude", "ellipsoidal_height"});
  }
  columns.needed = *std::max_element(columns.index.begin(), columns.index.end()) + 1;
}

/// Reads the times of a file: all are seconds from `start`, or all are dates.
class CsvTimes {
 public:
  CsvTimes(const TextFile& file, GpsTime start, FileNotes& notes)
      : file_(file), start_(start), notes_(notes) {}

  GpsTime read(std::string_view text) {
    const std::optional<double> seconds = field_number(text);
    const Kind kind = seconds ? Kind::FromStart : Kind::Dates;
    if (kind_ != Kind::Unknown && kind_ != kind) {
      throw file_.error(fmt::format("the time '{}' is written in another way than above", text),
                        "use seconds from the start or ISO 8601 throughout");
    }
    const bool first = kind_ == Kind::Unknown;
    kind_ = kind;
    return seconds ? from_start(*seconds, text) : dated(text, first);
  }
  [[nodiscard]] bool relative() const { return kind_ == Kind::FromStart; }

 private:
  enum class Kind : std::uint8_t { Unknown, FromStart, Dates };

  [[nodiscard]] GpsTime from_start(double seconds, std::string_view text) const {
    if (start_ == GpsTime{}) {
      throw file_.error("times are seconds from the start, and the scenario has no start",
                        "add 'start: 2026-01-01T12:00:00Z' to the scenario, or write ISO 8601 times");
    }
    if (std::abs(seconds) > 1e7) {
      throw file_.error(fmt::format("the time {} s is out of range", text),
                        "times are seconds from the scenario's start (not Unix time), or ISO 8601");
    }
    return start_ + seconds;
  }
  [[nodiscard]] GpsTime dated(std::string_view text, bool first) const {
    if (first && !geodesy::names_time_scale(text)) {
      notes_.warn(
          file_.error(fmt::format("the time {} names no zone", text), "such times are taken as UTC").what());
    }
    try {
      return geodesy::parse_simulated_time(text);
    } catch (const InputError& e) {
      bool written = true;
      try {
        (void)geodesy::parse_time(text);
      } catch (const InputError&) {
        written = false;
      }
      throw file_.error(
          written ? e.problem() : fmt::format("the time '{}' is neither a number nor ISO 8601", text),
          e.cure().empty() ? e.problem() : e.cure());
    }
  }

  const TextFile& file_;
  GpsTime start_;
  FileNotes& notes_;
  Kind kind_ = Kind::Unknown;
};

TrajectoryFile read_csv(TextFile& file, GpsTime start, const HeightReading& heights) {
  FileNotes notes(file.path());
  CsvTimes times(file, start, notes);
  ColumnPoints points(file, heights);
  CsvColumns columns;
  std::optional<std::string> header;
  bool first = true, first_data = true;
  while (const auto line = file.next_line()) {
    if (is_skipped(*line) || line == header) continue;
    if (first) columns.separator = separator_of(*line);
    const std::vector<std::string_view> fields = csv_fields(*line, columns.separator);
    if (std::exchange(first, false) && is_csv_header(fields)) {
      read_csv_header(file, fields, columns);
      header = *line;
      continue;
    }
    if (fields.size() < columns.needed) {
      if (!points.empty() && !file.peek_line()) {
        points.skip_damaged();
        break;
      }
      throw file.error(
          fmt::format("{} columns where {} are needed", fields.size(), columns.needed),
          "columns are time, latitude, longitude, height, with commas, semicolons or tabs between");
    }
    const auto& index = columns.index;
    const Coordinates place{fields[index[1]], fields[index[2]], fields[index[3]]};
    if (std::exchange(first_data, false) && !header) {
      const auto x = field_number(place[0]), y = field_number(place[1]), z = field_number(place[2]);
      columns.ecef = x && y && z && looks_like_ecef(*x, *y, *z);
      if (columns.ecef) notes.say("columns 2 to 4 are taken as ECEF x, y, z in metres");
    }
    if (is_missing(fields[index[0]])) {
      points.skip_missing();
    } else {
      points.add(times.read(fields[index[0]]), place, columns.ecef);
    }
  }
  return points.take(!times.relative(), std::move(notes), kCsvColumns);
}

// --- urbannav ----------------------------------------------------------------------------------------------

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

TrajectoryFile read_urbannav(TextFile& file, const HeightReading& heights) {
  ColumnPoints points(file, heights);
  bool first = true;
  std::string latitude, longitude;
  while (const auto line = file.next_line()) {
    if (is_skipped(*line)) continue;
    std::vector<std::string_view> fields = split(*line, ',');
    if (std::exchange(first, false) && is_csv_header(fields)) continue;
    // The drives of 2021: UNIX time, week, time of week, two angles in degrees, minutes, seconds, height, ...
    if (const auto words = split_blanks(*line); fields.size() == 1 && words.size() >= 10) {
      latitude = degrees_of(file, words[3], words[4], words[5]);
      longitude = degrees_of(file, words[6], words[7], words[8]);
      fields = {words[1], words[2], latitude, longitude, words[9]};
    }
    if (fields.size() < 5) {
      if (!points.empty() && !file.peek_line()) {
        points.skip_damaged();
        break;
      }
      throw file.error(fmt::format("{} columns where 5 are needed", fields.size()),
                       "columns are GPS week, time of week, latitude, longitude, height");
    }
    const double week = to_number(file, fields[0], "GPS week");
    if (week != std::floor(week) || week < 0 || week > 9999) {
      throw file.error(
          fmt::format("the GPS week '{}' is not a whole number of weeks since 1980", trim(fields[0])),
          "format urbannav is: GPS week, time of week, latitude, longitude, height");
    }
    const double tow = to_number(file, fields[1], "time of week");
    if (tow < 0 || tow >= static_cast<double>(GpsTime::kSecondsPerWeek)) {
      throw file.error(fmt::format("the time of week {} s is out of range", trim(fields[1])),
                       "it runs from 0 to 604800 s");
    }
    points.add(GpsTime::from_week(static_cast<int>(week), tow), {fields[2], fields[3], fields[4]}, false);
  }
  return points.take(true, FileNotes(file.path()), "'GPS week, time of week, latitude, longitude, height'");
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
  if (is_track_format(format)) {
    const TrackFile track = read_track_file(path, format, heights);
    if (track.times.empty()) {
      throw InputError(path, 0, "the path has no times", "name it in a scenario, with trajectory.speed_mps");
    }
    return timed_trajectory(path, track);
  }
  if (format == "gnsslogger") return read_android_fixes(path, heights);
  if (format == "nmea") {
    NmeaFixes nmea = read_nmea_fixes(path, start, heights);
    TrajectoryFile file = recorded_trajectory(std::move(nmea.fixes), nmea.has_own_dates, FileNotes(path));
    file.warnings.insert(file.warnings.begin(), nmea.warnings.begin(), nmea.warnings.end());
    return file;
  }
  TextFile file(path);
  return format == "csv" ? read_csv(file, start, heights) : read_urbannav(file, heights);
}

Trajectory read_trajectory(const std::filesystem::path& path, const std::string& format, GpsTime start) {
  return read_trajectory_file(path, format, start).trajectory;
}

}  // namespace canyon::simulation
