#include "canyon/simulation/motion/recorded_path.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <utility>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/simulation/motion/csv_track.hpp"
#include "canyon/simulation/motion/nmea_fixes.hpp"
#include "canyon/simulation/motion/track_file.hpp"

namespace canyon::simulation {

using geodesy::Geodetic;
using geodesy::GpsTime;

namespace {

void note_pauses(const Trajectory& trajectory, ReadReport& report) {
  const auto pauses = trajectory.pauses();
  if (pauses.empty()) return;
  const auto longest = *std::max_element(pauses.begin(), pauses.end(), [](const auto& a, const auto& b) {
    return a.second - a.first < b.second - b.first;
  });
  report.guess(0,
               fmt::format("the recording has {} {}, the longest of {:.0f} s from {}", pauses.size(),
                           pauses.size() == 1 ? "pause" : "pauses", longest.second - longest.first,
                           geodesy::format_gpst(longest.first, 0)),
               "such a gap is driven straight; set start and duration_s to a part without it");
}

}  // namespace

void drop_unordered(RecordedPath& path) {
  RecordedPoints& points = path.points;
  if (points.empty()) return;
  constexpr double kYear_s = 365.25 * 86'400;
  std::vector<GpsTime> times;
  for (const RecordedPoint& point : points) times.push_back(point.time);
  const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
  std::nth_element(times.begin(), middle, times.end());
  // The longest increasing subsequence, searched from the end: latest[n] begins the one of n + 1 points with
  // the latest begin; behind[i] follows point i.
  std::vector<std::size_t> latest, after(points.size(), points.size());
  for (std::size_t i = points.size(); i-- > 0;) {
    if (std::abs(points[i].time - *middle) > kYear_s) continue;
    const auto at = std::partition_point(latest.begin(), latest.end(),
                                         [&](std::size_t j) { return points[j].time > points[i].time; });
    if (at != latest.begin()) after[i] = *std::prev(at);
    if (at == latest.end())
      latest.push_back(i);
    else
      *at = i;
  }
  RecordedPoints kept;
  std::size_t next = latest.back(), wrong = 0;
  int first_wrong = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const RecordedPoint& point = points[i];
    if (i == next) {
      kept.push_back(point);
      next = after[i];
    } else if (!kept.empty() && point.time == kept.back().time) {
      // Times truncated to seconds would drop most of a log.
      const Eigen::Vector3d step =
          geodesy::ecef_from_geodetic(point.position) - geodesy::ecef_from_geodetic(kept.back().position);
      if (step.norm() > 1)
        path.report.loss(point.line, "point with the time of the previous one, at another position");
      else
        path.report.remark(point.line, "point that repeats the time of the previous one", "left out");
    } else {
      if (wrong++ == 0) first_wrong = point.line;
      path.report.loss(point.line, "point whose time is out of order");
    }
  }
  if (2 * wrong > points.size()) {
    throw InputError(path.report.path(), first_wrong,
                     fmt::format("the times of {} of {} points are out of order", wrong, points.size()),
                     "sort the points by time");
  }
  points = std::move(kept);
}

TrajectoryFile recorded_trajectory(RecordedPath path) {
  drop_unordered(path);
  std::vector<std::pair<GpsTime, Geodetic>> samples;
  samples.reserve(path.points.size());
  for (const RecordedPoint& point : path.points) samples.emplace_back(point.time, point.position);
  Trajectory trajectory(std::move(samples));
  note_pauses(trajectory, path.report);
  return {std::move(trajectory), path.is_dated, std::move(path.report)};
}

std::string_view columns_hint() {
  return "name the columns time, latitude, longitude, height, or give them with their units, such as "
         "trajectory.columns: {time: stamp, latitude: \"lat [rad]\", longitude: \"lon [rad]\", height: "
         "alt_m}";
}

bool is_missing(std::string_view text) {
  text = trim(text);
  if (text.empty()) return true;
  // No-data numbers of databases, rasters and integers.
  constexpr std::array kNumbers{-9999.0,  -99999.0,      -999999.0,   -32767.0,
                                -32768.0, -2147483648.0, 2147483647.0};
  constexpr std::array<std::string_view, 6> kWords{"nan", "-nan", "null", "none", "n/a", "-"};
  if (std::isdigit(static_cast<unsigned char>(text.front())) != 0 && !text.starts_with("21474")) return false;
  const auto value = number_of(text);
  return value ? std::find(kNumbers.begin(), kNumbers.end(), *value) != kNumbers.end()
               : std::find(kWords.begin(), kWords.end(), lower_case(text)) != kWords.end();
}

std::optional<double> number_of(std::string_view text) {
  std::string with_point(text);
  std::replace(with_point.begin(), with_point.end(), ',', '.');
  return parse_double(with_point);
}

double to_number(const RecordAt& at, std::string_view text, std::string_view what) {
  if (is_missing(text) && !trim(text).empty())
    throw NoValue(at.report.path(), at.line, fmt::format("the {} '{}' is a no-data value", what, trim(text)));
  const std::optional<double> value = number_of(text);
  if (!value) throw at.error(fmt::format("the {} '{}' is not a number", what, trim(text)));
  return *value;
}

Geodetic position_of(const RecordAt& at, double latitude_deg, double longitude_deg) {
  const auto check = [&at](const char* what, double value_deg, double limit_deg) {
    if (std::abs(value_deg) <= limit_deg) return;
    throw at.error(fmt::format("the {} {} deg is out of range", what, value_deg),
                   fmt::format("give a value from -{0} to {0} deg", limit_deg));
  };
  check("latitude", latitude_deg, 90);
  check("longitude", longitude_deg, 180);
  if (is_null_island(latitude_deg, longitude_deg))
    throw NoValue(at.report.path(), at.line, "latitude 0, longitude 0, as before a fix");
  return Geodetic::from_degrees(latitude_deg, longitude_deg, 0);
}

Geodetic position_of(const RecordAt& at, const Eigen::Vector3d& ecef) {
  if (ecef.isZero()) throw NoValue(at.report.path(), at.line, "x, y, z of 0, as before a fix");
  if (!is_radius(ecef.norm())) {
    throw at.error(fmt::format("x, y, z are {:.6g} m from the Earth's centre", ecef.norm()),
                   "give ECEF with its unit: x_km, or trajectory.columns: {x: \"x [km]\"}");
  }
  return geodesy::geodetic_from_ecef(ecef);
}

GpsTime set_time(const RecordAt& at, GpsTime time) {
  if (time >= geodesy::gps_from_calendar({1981, 1, 1, 0, 0, 0, 0})) return time;
  throw NoValue(at.report.path(), at.line, "time before 1981, as of a clock that was never set");
}

GpsTime time_of_week(const RecordAt& at, double week, double tow_s) {
  if (week != std::floor(week) || !(week >= 0 && week < 10'000))
    throw at.error(fmt::format("the GPS week '{}' is not a whole number of weeks since 1980", week));
  if (!(tow_s >= 0 && tow_s < static_cast<double>(GpsTime::kSecondsPerWeek)))
    throw at.error(fmt::format("the time of week {} s is out of range", tow_s), "give 0 to 604800 s");
  return set_time(at, GpsTime::from_week(static_cast<int>(week), tow_s));
}

GpsTime time_of_text(const RecordAt& at, std::string_view text) {
  const auto year = parse_integer(column(trim(text), 0, 4));
  if (year && *year < 1981) return set_time(at, {});
  try {
    const GpsTime time = geodesy::parse_simulated_time(text);
    if (!geodesy::names_time_scale(text)) at.report.guess(at.line, "time without time zone", "taken as UTC");
    return time;
  } catch (const InputError& e) {
    throw at.error(e.problem(), e.hint());
  }
}

double from_sea_level(const RecordAt& at, double height_m, std::string_view of,
                      const HeightReading& heights) {
  if (heights.needed) {
    at.report.guess(
        at.line, of,
        heights.geoid_undulation_m != 0
            ? fmt::format("the city's geoid undulation, {:.1f} m, is added", heights.geoid_undulation_m)
            : "taken as ellipsoidal; city.geoid_undulation_m corrects it, height_above_terrain_m makes it "
              "unnecessary");
  }
  return height_m + heights.geoid_undulation_m;
}

// The formats of recorded paths.

const std::vector<std::string>& trajectory_formats() {
  static const std::vector<std::string> formats{"csv", "urbannav", "rtklib",    "nmea",
                                                "gpx", "kml",      "gnsslogger"};
  return formats;
}

std::string trajectory_format_of(const std::filesystem::path& path) {
  const FileKind kind = file_kind(path);
  if (const std::string_view format = trajectory_format(kind); !format.empty()) return std::string(format);
  if (kind == FileKind::Columns && is_rtklib(path)) return "rtklib";
  return kind == FileKind::Columns && is_urbannav(path) ? "urbannav" : "csv";
}

RecordedPath read_recorded_path(const std::filesystem::path& path, const std::string& given, GpsTime start,
                                const HeightReading& heights, const TrajectoryColumns& columns) {
  const std::string format = !given.empty() ? given : columns.empty() ? trajectory_format_of(path) : "csv";
  if (std::find(trajectory_formats().begin(), trajectory_formats().end(), format) ==
      trajectory_formats().end()) {
    throw InputError(fmt::format("trajectory format '{}' is unknown", format),
                     fmt::format("it is one of {}", fmt::join(trajectory_formats(), ", ")));
  }
  return read_as(kind_of_trajectory(format), path, [&] {
    if (format == "gpx" || format == "kml") return read_track_file(path, format, heights);
    if (format == "gnsslogger") return read_android_fixes(path, heights);
    if (format == "nmea") return read_nmea(path, start, heights);
    TextFile file(path);
    if (format == "urbannav") return read_urbannav(file);
    return format == "rtklib" ? read_rtklib(file, heights) : read_csv(file, start, heights, columns);
  });
}

TrajectoryFile read_trajectory_file(const std::filesystem::path& path, const std::string& format,
                                    GpsTime start, const HeightReading& heights,
                                    const TrajectoryColumns& columns) {
  RecordedPath recorded = read_recorded_path(path, format, start, heights, columns);
  if (!recorded.timed)
    throw InputError(path, 0, "the path has no times", "name it in a scenario, with trajectory.speed_mps");
  return recorded_trajectory(std::move(recorded));
}

}  // namespace canyon::simulation
