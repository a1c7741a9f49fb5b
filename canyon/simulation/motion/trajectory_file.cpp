// Readers of recorded trajectories: CSV, UrbanNav's truth files, NMEA 0183 logs.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <utility>

#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/geodesy/time_text.hpp"
#include "canyon/simulation/motion/nmea_fixes.hpp"
#include "canyon/simulation/motion/track_file.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;
using Samples = std::vector<std::pair<GpsTime, Geodetic>>;

double to_number(const TextFile& file, std::string_view text, std::string_view what) {
  const std::optional<double> value = parse_double(text);
  if (!value) throw file.error(fmt::format("the {} '{}' is not a number", what, trim(text)));
  return *value;
}

// NMEA writes degrees and minutes in one number, ddmm.mmmm.
bool looks_like_degrees_and_minutes(double value, double limit_deg) {
  const double degrees = std::trunc(std::abs(value) / 100);
  const double minutes = std::abs(value) - 100 * degrees;
  return degrees >= 1 && degrees <= limit_deg && minutes < 60;
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

Geodetic to_place(const TextFile& file, std::string_view latitude, std::string_view longitude,
                  std::string_view height) {
  // No latitude, but a longitude beside a latitude: 114.17, 22.30. In ddmm.mm 114.17 would be 1 deg 14 min,
  // and the other one below a degree.
  const std::optional<double> first = parse_double(latitude);
  const std::optional<double> second = parse_double(longitude);
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

void append(const TextFile& file, Samples& samples, GpsTime time, const Geodetic& place) {
  if (!samples.empty() && time <= samples.back().first) {
    const bool same = time == samples.back().first;
    throw file.error(same ? fmt::format("the time {} comes twice", format_gpst(time, 3))
                          : fmt::format("the time {} is before the line above ({})", format_gpst(time, 3),
                                        format_gpst(samples.back().first, 3)),
                     same ? "keep one line for each time" : "sort the lines by time");
  }
  samples.emplace_back(time, place);
}

[[noreturn]] void refuse_empty(const TextFile& file, std::string_view expected) {
  throw InputError(file.path(), 0, "no position in it", fmt::format("expected lines of {}", expected));
}

bool is_skipped(std::string_view line) {
  line = trim(line);
  return line.empty() || line.front() == '#';
}

// --- csv ---------------------------------------------------------------------------------------------------

struct CsvColumns {
  std::array<std::size_t, 4> index{0, 1, 2, 3};  // time, latitude, longitude, height
  std::size_t needed = 4;
};
constexpr std::array<std::string_view, 4> kCsvNames{"time", "latitude", "longitude", "height"};

bool is_csv_header(const std::vector<std::string_view>& fields) {
  // A data line has numbers for latitude and longitude; a broken number must not turn a line into a header.
  return std::none_of(fields.begin(), fields.end(),
                      [](std::string_view f) { return parse_double(f).has_value(); }) &&
         std::isalpha(static_cast<unsigned char>(trim(fields.front()).front()));
}

CsvColumns read_csv_header(const TextFile& file, const std::vector<std::string_view>& fields) {
  const std::array<std::vector<std::string>, 4> words{
      {{"time", "timestamp", "t", "time_s", "utc", "gpst"},
       {"latitude", "lat"},
       {"longitude", "lon", "lng", "long"},
       {"height", "h", "alt", "altitude", "ellipsoidal_height"}}};
  CsvColumns columns;
  columns.needed = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    bool found = false;
    for (std::size_t i = 0; i < fields.size() && !found; ++i) {
      std::string field = lower_case(trim(fields[i]));
      for (const std::string_view unit : {"_deg", "_m", "(deg)", "(m)", "[deg]", "[m]"}) {
        if (field.size() > unit.size() && field.compare(field.size() - unit.size(), unit.size(), unit) == 0) {
          field = std::string(trim(std::string_view(field).substr(0, field.size() - unit.size())));
        }
      }
      if (field.size() > 4 && field.compare(field.size() - 4, 4, "_rad") == 0) {
        throw file.error(fmt::format("the column '{}' is in radians", trim(fields[i])), "write degrees");
      }
      if (std::find(words[k].begin(), words[k].end(), field) == words[k].end()) continue;
      columns.index[k] = i;
      columns.needed = std::max(columns.needed, i + 1);
      found = true;
    }
    if (!found) {
      throw file.error(fmt::format("the header has no column '{}'", kCsvNames[k]),
                       "name the columns time, latitude, longitude, height");
    }
  }
  return columns;
}

TrajectoryFile read_csv(TextFile& file, GpsTime start) {
  Samples samples;
  CsvColumns columns;
  std::optional<bool> relative;
  std::vector<std::string> warnings;
  bool first = true;
  while (const auto line = file.next_line()) {
    if (is_skipped(*line)) continue;
    const std::vector<std::string_view> fields = split(*line, ',');
    if (std::exchange(first, false) && !trim(fields.front()).empty() && is_csv_header(fields)) {
      columns = read_csv_header(file, fields);
      continue;
    }
    if (fields.size() < columns.needed) {
      throw file.error(fmt::format("{} columns where {} are needed", fields.size(), columns.needed),
                       "columns are time, latitude, longitude, height, with commas between");
    }
    const std::string_view time_text = trim(fields[columns.index[0]]);
    const std::optional<double> seconds = parse_double(time_text);
    if (relative && *relative != seconds.has_value()) {
      throw file.error(fmt::format("the time '{}' is written in another way than above", time_text),
                       "use seconds from the start or ISO 8601 throughout");
    }
    relative = seconds.has_value();
    GpsTime time;
    if (seconds) {
      if (start == GpsTime{}) {
        throw file.error("times are seconds from the start, and the scenario has no start",
                         "add 'start: 2026-01-01T12:00:00Z' to the scenario, or write ISO 8601 times");
      }
      if (std::abs(*seconds) > 1e7) {
        throw file.error(fmt::format("the time {} s is out of range", time_text),
                         "times are seconds from the scenario's start (not Unix time), or ISO 8601");
      }
      time = start + *seconds;
    } else {
      if (warnings.empty() && !geodesy::names_time_scale(time_text)) {
        warnings.push_back(
            file.error(fmt::format("the time {} names no zone", time_text), "such times are taken as UTC")
                .what());
      }
      try {
        time = geodesy::parse_simulated_time(time_text);
      } catch (const InputError& e) {
        bool written = true;
        try {
          (void)geodesy::parse_time(time_text);
        } catch (const InputError&) {
          written = false;
        }
        throw file.error(
            written ? e.problem() : fmt::format("the time '{}' is neither a number nor ISO 8601", time_text),
            e.cure().empty() ? e.problem() : e.cure());
      }
    }
    append(file, samples, time,
           to_place(file, fields[columns.index[1]], fields[columns.index[2]], fields[columns.index[3]]));
  }
  if (samples.empty()) refuse_empty(file, "'time, latitude, longitude, height'");
  return {Trajectory(std::move(samples)), !*relative, std::move(warnings)};
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

TrajectoryFile read_urbannav(TextFile& file) {
  Samples samples;
  bool first = true;
  std::string latitude, longitude;
  while (const auto line = file.next_line()) {
    if (is_skipped(*line)) continue;
    std::vector<std::string_view> fields = split(*line, ',');
    if (std::exchange(first, false) && !trim(fields.front()).empty() && is_csv_header(fields)) continue;
    // The drives of 2021: UNIX time, week, time of week, two angles in degrees, minutes, seconds, height, ...
    if (const auto words = split_blanks(*line); fields.size() == 1 && words.size() >= 10) {
      latitude = degrees_of(file, words[3], words[4], words[5]);
      longitude = degrees_of(file, words[6], words[7], words[8]);
      fields = {words[1], words[2], latitude, longitude, words[9]};
    }
    if (fields.size() < 5) {
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
    append(file, samples, GpsTime::from_week(static_cast<int>(week), tow),
           to_place(file, fields[2], fields[3], fields[4]));
  }
  if (samples.empty()) refuse_empty(file, "'GPS week, time of week, latitude, longitude, height'");
  return {Trajectory(std::move(samples)), true, {}};
}

// --- nmea --------------------------------------------------------------------------------------------------

constexpr std::int64_t kNanosecondsPerDay = 86'400 * GpsTime::kNanosecondsPerSecond;

// Fields of a sentence whose checksum holds (or that has none), the address first; empty otherwise.
std::vector<std::string_view> nmea_fields(std::string_view line, bool& bad_checksum) {
  bad_checksum = false;
  line = trim(line);
  const std::size_t dollar = line.find('$');
  if (dollar == std::string_view::npos) return {};
  line.remove_prefix(dollar + 1);
  const std::size_t star = line.rfind('*');
  if (star != std::string_view::npos) {
    unsigned sum = 0;
    for (const char c : line.substr(0, star)) sum ^= static_cast<unsigned char>(c);
    const std::string_view digits = trim(line.substr(star + 1));
    const auto hex = [](char c) -> unsigned {
      if (c >= '0' && c <= '9') return static_cast<unsigned>(c - '0');
      const char lower = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      return lower >= 'a' && lower <= 'f' ? static_cast<unsigned>(lower - 'a') + 10 : 256U;
    };
    if (digits.size() != 2 || hex(digits[0]) * 16 + hex(digits[1]) != sum) {
      bad_checksum = true;
      return {};
    }
    line = line.substr(0, star);
  }
  return split(line, ',');
}

bool is_sentence(const std::vector<std::string_view>& fields, std::string_view type) {
  return !fields.empty() && fields[0].size() == 5 && fields[0].substr(2) == type;
}

// hhmmss.sss as nanoseconds of the UTC day (a leap second's 235960 comes out as 24 h).
std::int64_t nmea_time_of_day(const TextFile& file, std::string_view text) {
  text = trim(text);
  const auto hour = parse_integer(column(text, 0, 2));
  const auto minute = parse_integer(column(text, 2, 2));
  const auto second = parse_double(column(text, 4, text.size()));
  const bool digits =
      std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) || c == '.'; });
  if (!digits || !hour || !minute || !second || *hour > 23 || *minute > 59 || *second >= 61) {
    throw file.error(fmt::format("the time '{}' is not hhmmss.ss", text));
  }
  return (*hour * 3600 + *minute * 60) * GpsTime::kNanosecondsPerSecond + std::llround(*second * 1e9);
}

GpsTime on_day(int year, int month, int day, std::int64_t time_of_day) {
  geodesy::CalendarTime midnight;
  midnight.year = year;
  midnight.month = month;
  midnight.day = day;
  return geodesy::gps_from_utc(midnight) + std::chrono::nanoseconds(time_of_day);
}

// Instant of a sentence that says the date (RMC, ZDA); nothing where its fields are empty.
std::optional<GpsTime> nmea_dated(const TextFile& file, const std::vector<std::string_view>& fields) {
  std::array<std::string_view, 3> text;  // day, month, year
  if (is_sentence(fields, "RMC") && fields.size() > 9 && trim(fields[9]).size() == 6) {
    const std::string_view date = trim(fields[9]);
    text = {date.substr(0, 2), date.substr(2, 2), date.substr(4, 2)};
  } else if (is_sentence(fields, "ZDA") && fields.size() > 4 && !trim(fields[4]).empty()) {
    text = {fields[2], fields[3], fields[4]};
  } else {
    return std::nullopt;
  }
  if (trim(fields[1]).empty()) return std::nullopt;
  std::array<int, 3> value{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto number = parse_integer(text[k]);
    if (!number || *number < 0 || *number > 9999) {
      throw file.error(fmt::format("the date '{}' is not day, month, year", trim(text[k])));
    }
    value[k] = static_cast<int>(*number);
  }
  if (is_sentence(fields, "RMC")) value[2] += value[2] < 80 ? 2000 : 1900;
  try {
    return on_day(value[2], value[1], value[0], nmea_time_of_day(file, fields[1]));
  } catch (const InputError& e) {
    if (e.line() != 0) throw;
    throw file.error(e.problem(), e.cure());
  }
}

// The instant with this time of day that lies closest to `near`.
GpsTime closest_day(std::int64_t time_of_day, GpsTime near) {
  GpsTime best;
  bool found = false;
  for (const int shift : {-1, 0, 1}) {
    const geodesy::CalendarTime date =
        geodesy::utc_from_gps(near + std::chrono::nanoseconds(shift * kNanosecondsPerDay));
    const GpsTime candidate = on_day(date.year, date.month, date.day, time_of_day);
    if (!found || std::abs(candidate - near) < std::abs(best - near)) best = candidate;
    found = true;
  }
  return best;
}

double nmea_angle_deg(const TextFile& file, std::string_view value_text, std::string_view side,
                      std::string_view positive_negative, double limit_deg, std::string_view what) {
  const double value = to_number(file, value_text, what);
  const double degrees = std::trunc(value / 100);
  const double minutes = value - 100 * degrees;
  const double angle = degrees + minutes / 60;
  side = trim(side);
  if (value < 0 || minutes >= 60 || angle > limit_deg) {
    throw file.error(fmt::format("the {} '{}' is not ddmm.mmmm", what, trim(value_text)));
  }
  if (side.size() != 1 || positive_negative.find(side[0]) == std::string_view::npos) {
    throw file.error(fmt::format("the {}'s side '{}' is neither {} nor {}", what, side, positive_negative[0],
                                 positive_negative[1]));
  }
  return side[0] == positive_negative[0] ? angle : -angle;
}

// The first dated sentence: GGA lines before it take their date from it.
std::optional<GpsTime> first_date(const TextFile& file) {
  TextFile copy = TextFile::from_string(std::string(file.text()), file.path());
  bool bad_checksum = false;
  while (const auto line = copy.next_line()) {
    const auto fields = nmea_fields(*line, bad_checksum);
    if (const auto dated = nmea_dated(copy, fields)) return dated;
  }
  return std::nullopt;
}

/// Whether a GGA sentence with all its fields has a fix.
bool has_fix(const std::vector<std::string_view>& gga) {
  const auto quality = parse_integer(gga[6]);
  return quality && *quality != 0 && !trim(gga[2]).empty() && !trim(gga[1]).empty();
}
constexpr std::size_t kGgaFields = 12;

/// Precondition: has_fix(). Without a separation of the geoid the altitude counts as ellipsoidal.
Geodetic gga_position(const TextFile& file, const std::vector<std::string_view>& gga) {
  double height_m = to_number(file, gga[9], "altitude");
  if (!trim(gga[11]).empty()) height_m += to_number(file, gga[11], "geoid separation");
  const double latitude_deg = nmea_angle_deg(file, gga[2], gga[3], "NS", 90, "latitude");
  const double longitude_deg = nmea_angle_deg(file, gga[4], gga[5], "EW", 180, "longitude");
  return Geodetic::from_degrees(latitude_deg, longitude_deg, height_m);
}

NmeaFixes read_nmea(TextFile& file, GpsTime start) {
  const std::optional<GpsTime> anchor = first_date(file);
  Samples samples;
  GpsTime now = anchor.value_or(start);
  std::size_t damaged = 0;
  std::size_t without_fix = 0;
  std::size_t without_separation = 0;
  while (const auto line = file.next_line()) {
    bool bad_checksum = false;
    const auto fields = nmea_fields(*line, bad_checksum);
    if (bad_checksum) ++damaged;
    if (const auto dated = nmea_dated(file, fields)) now = *dated;
    if (!is_sentence(fields, "GGA")) continue;
    if (fields.size() < kGgaFields) {  // cut short, as the last line of a log may be
      ++damaged;
      continue;
    }
    if (!has_fix(fields)) {
      ++without_fix;
      continue;
    }
    if (!anchor && start == GpsTime{}) {
      throw file.error("no RMC or ZDA sentence has the date, and the scenario has no start",
                       "add 'start: 2026-01-01T12:00:00Z' to the scenario");
    }
    const std::int64_t time_of_day = nmea_time_of_day(file, fields[1]);
    if (!anchor && samples.empty()) {
      const geodesy::CalendarTime date = geodesy::utc_from_gps(start);
      now = on_day(date.year, date.month, date.day, time_of_day);
    } else {
      now = closest_day(time_of_day, now);
    }
    if (trim(fields[11]).empty()) ++without_separation;
    append(file, samples, now, gga_position(file, fields));
  }
  if (samples.empty()) {
    throw InputError(
        file.path(), 0,
        fmt::format("no usable GGA sentence ({} without fix, {} damaged or with a wrong checksum)",
                    without_fix, damaged),
        "expected lines like $GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47");
  }
  NmeaFixes result{std::move(samples), anchor.has_value(), {}};
  const auto say = [&](std::size_t count, std::string_view what) {
    if (count > 0) result.warnings.push_back(fmt::format("{}: {} {}", file.path().string(), count, what));
  };
  say(damaged, "damaged lines (cut short, or with a wrong checksum) skipped");
  say(without_fix, "GGA lines without a fix skipped");
  say(without_separation,
      "GGA lines have no geoid separation: their altitude is taken as ellipsoidal height");
  return result;
}

}  // namespace

const std::vector<std::string>& trajectory_formats() {
  static const std::vector<std::string> formats{"csv", "urbannav", "nmea", "gpx", "kml"};
  return formats;
}

TrajectoryFile read_trajectory_file(const std::filesystem::path& path, const std::string& format,
                                    GpsTime start) {
  if (std::find(trajectory_formats().begin(), trajectory_formats().end(), format) ==
      trajectory_formats().end()) {
    throw InputError(fmt::format("trajectory format '{}' is unknown", format),
                     "it is csv, urbannav, nmea, gpx or kml");
  }
  if (is_track_format(format)) {
    TrackFile track = read_track_file(path, format);
    if (track.times.empty()) {
      throw InputError(path, 0, "the path has no times", "name it in a scenario, with trajectory.speed_mps");
    }
    Samples samples;
    for (std::size_t i = 0; i < track.places.size(); ++i)
      samples.emplace_back(track.times[i], track.places[i]);
    return {Trajectory(std::move(samples)), true, std::move(track.warnings)};
  }
  TextFile file(path);
  if (format == "csv") return read_csv(file, start);
  if (format == "urbannav") return read_urbannav(file);
  NmeaFixes nmea = read_nmea(file, start);
  return {Trajectory(std::move(nmea.fixes)), nmea.has_own_dates, std::move(nmea.warnings)};
}

NmeaFixes read_nmea_fixes(const std::filesystem::path& path, GpsTime start) {
  TextFile file(path);
  return read_nmea(file, start);
}

std::optional<Geodetic> position_of_gga(std::string_view line) {
  bool bad_checksum = false;
  const auto fields = nmea_fields(line, bad_checksum);
  if (!is_sentence(fields, "GGA") || fields.size() < kGgaFields || !has_fix(fields)) return std::nullopt;
  try {
    return gga_position(TextFile::from_string(std::string(line), "GGA"), fields);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

Trajectory read_trajectory(const std::filesystem::path& path, const std::string& format, GpsTime start) {
  return read_trajectory_file(path, format, start).trajectory;
}

}  // namespace canyon::simulation
