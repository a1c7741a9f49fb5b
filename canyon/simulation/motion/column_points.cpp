#include "canyon/simulation/motion/column_points.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <utility>

#include "canyon/base/text.hpp"

namespace canyon::simulation {

using geodesy::Geodetic;
using geodesy::GpsTime;

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

std::string without_groups(std::string_view text, char mark) {
  const char group = mark == '.' ? ',' : '.';
  const std::string_view number = trim(text);
  const std::string_view whole = number.substr(0, number.find(mark));
  const std::string_view digits = whole.substr(whole.find_first_not_of("+-") == 1 ? 1 : 0);
  const std::vector<std::string_view> groups = split(digits, group);
  bool grouped = groups.size() > 1 && !groups[0].empty() && groups[0].size() <= 3;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    grouped =
        grouped && (i == 0 || groups[i].size() == 3) &&
        std::all_of(groups[i].begin(), groups[i].end(), [](unsigned char c) { return std::isdigit(c) != 0; });
  }
  std::string plain(text);
  if (grouped) plain.erase(std::remove(plain.begin(), plain.end(), group), plain.end());
  return plain;
}

GpsTime time_of_week(const TextFile& file, std::string_view week_text, double tow_s) {
  const double week = to_number(file, week_text, "GPS week");
  if (week != std::floor(week) || week < 0 || week > 9999) {
    throw file.error(
        fmt::format("the GPS week '{}' is not a whole number of weeks since 1980", trim(week_text)),
        "a position has GPS week, time of week, latitude, longitude, height");
  }
  constexpr double kFirstRollover = 1024;
  if (week < kFirstRollover) {
    throw file.error(fmt::format("the GPS week {} is before 1999; it seems to be counted modulo 1,024", week),
                     fmt::format("write full weeks: {} is in 2019 to 2038", week + 2 * kFirstRollover));
  }
  if (!(tow_s >= 0 && tow_s < static_cast<double>(GpsTime::kSecondsPerWeek))) {
    throw file.error(fmt::format("the time of week {} s is out of range", tow_s),
                     "it runs from 0 to 604800 s");
  }
  return GpsTime::from_week(static_cast<int>(week), tow_s);
}

bool looks_like_ecef(double x, double y, double z) {
  const double norm_m = std::hypot(x, y, z);
  return norm_m > 6.3e6 && norm_m < 6.5e6 && (std::abs(x) > 360 || std::abs(y) > 360);
}

bool is_skipped(std::string_view line) {
  line = trim(line);
  return line.empty() || line.front() == '#';
}

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
  // A data line has numbers; a broken number must not turn a line into a header.
  const auto begins_with = [&](int (*kind)(int)) {
    return std::any_of(fields.begin(), fields.end(), [kind](std::string_view field) {
      return !field.empty() && kind(static_cast<unsigned char>(field.front())) != 0;
    });
  };
  return begins_with(std::isalpha) && !begins_with(std::isdigit) &&
         std::none_of(fields.begin(), fields.end(), [](auto f) { return parse_double(f).has_value(); });
}

namespace {

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
    throw file.error(
        problem,
        fmt::format("it looks like degrees times 1e7: name the column {0}_e7, or {0}_semicircles for "
                    "FIT's unit (heights beside may be in mm: height_mm)",
                    what));
  }
  throw file.error(problem,
                   fmt::format("it runs from -{0} to {0} deg; check the order of the columns", limit_deg));
}

using Coordinates = ColumnPoints::Coordinates;
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

}  // namespace

void ColumnPoints::add(GpsTime time, Coordinates text, bool ecef) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(k == 2 && !ecef ? is_missing_height(text[k]) : is_missing(text[k]))) continue;
    if (k == 2 && !ecef && !heights_.needed) {
      text[k] = points_.empty() ? "0" : std::string_view(last_height_);
      break;
    }
    skip_missing();
    if (!first_missing_) {
      first_missing_ = file_.error(
          fmt::format("the {} '{}' is not a number",
                      ecef ? std::string_view("xyz").substr(k, 1) : kGeodeticNames[k], trim(text[k])));
    }
    return;
  }
  points_.push_back({time, ecef ? ecef_place(file_, text) : geodetic_place(file_, text), file_.line()});
  last_height_ = text[2];
}

TrajectoryFile ColumnPoints::take(bool has_own_dates, std::string_view expected) {
  notes_.require_most(points_.size());
  if (!points_.empty()) return recorded_trajectory(std::move(points_), has_own_dates, std::move(notes_));
  if (const std::size_t no_fix = notes_.count(kNoFix); no_fix > 0) {
    throw InputError(file_.path(), 0,
                     fmt::format("none of {} lines has a fix by the file's own column", no_fix),
                     "leave the column out if it means something else");
  }
  if (first_missing_) throw InputError(*first_missing_);
  throw InputError(file_.path(), 0, "no position in it", fmt::format("expected lines of {}", expected));
}

}  // namespace canyon::simulation
