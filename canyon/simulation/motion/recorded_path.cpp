#include "canyon/simulation/motion/recorded_path.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

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
               fmt::format("the recording pauses {} {}, at most {:.0f} s from {}", pauses.size(),
                           pauses.size() == 1 ? "time" : "times", longest.second - longest.first,
                           geodesy::format_gpst(longest.first, 0)),
               "such a gap is driven straight; start and duration_s choose a part without it");
}

}  // namespace

void keep_rising(RecordedPath& path) {
  RecordedPoints kept;
  std::size_t back = 0;
  int first_back = 0;
  for (const RecordedPoint& point : path.points) {
    if (kept.empty() || point.time > kept.back().time) {
      kept.push_back(point);
    } else if (point.time == kept.back().time) {
      // Times cut to seconds would lose most of a log.
      const Eigen::Vector3d step =
          geodesy::ecef_from_geodetic(point.place) - geodesy::ecef_from_geodetic(kept.back().place);
      if (step.norm() > 1)
        path.report.loss(point.line, "point with the time of the one before, at another place");
      else
        path.report.remark(point.line, "point that repeats the time of the one before", "left out");
    } else {
      if (back++ == 0) first_back = point.line;
      path.report.loss(point.line, "point whose time is before that of the one above");
    }
  }
  if (2 * back > path.points.size()) {
    throw InputError(
        path.report.path(), first_back,
        fmt::format("the times of {} of {} points are before that of one above", back, path.points.size()),
        "sort the points by time, and correct the time above this line if it alone is wrong");
  }
  path.points = std::move(kept);
}

TrajectoryFile recorded_trajectory(RecordedPath path) {
  keep_rising(path);
  std::vector<std::pair<GpsTime, Geodetic>> samples;
  samples.reserve(path.points.size());
  for (const RecordedPoint& point : path.points) samples.emplace_back(point.time, point.place);
  Trajectory trajectory(std::move(samples));
  note_pauses(trajectory, path.report);
  return {std::move(trajectory), path.has_own_dates, std::move(path.report)};
}

std::string_view columns_cure() {
  return "name the columns time, latitude, longitude, height, or say which they are and their units, such as "
         "trajectory.columns: {time: stamp, latitude: \"lat [rad]\", longitude: \"lon [rad]\", height: "
         "alt_m}";
}

bool is_missing(std::string_view text) {
  const std::string word = lower_case(trim(text));
  return word.empty() || word == "nan";
}

std::optional<double> number_of(std::string_view text) {
  std::string with_point(text);
  std::replace(with_point.begin(), with_point.end(), ',', '.');
  return parse_double(with_point);
}

double to_number(const RecordAt& at, std::string_view text, std::string_view what) {
  const std::optional<double> value = number_of(text);
  if (!value) throw at.error(fmt::format("the {} '{}' is not a number", what, trim(text)));
  return *value;
}

Geodetic place_of(const RecordAt& at, double latitude_deg, double longitude_deg) {
  const auto check = [&at](const char* what, double value_deg, double limit_deg) {
    if (std::abs(value_deg) <= limit_deg) return;
    throw at.error(fmt::format("the {} {} deg is out of range", what, value_deg),
                   fmt::format("it runs from -{0} to {0} deg", limit_deg));
  };
  check("latitude", latitude_deg, 90);
  check("longitude", longitude_deg, 180);
  return Geodetic::from_degrees(latitude_deg, longitude_deg, 0);
}

GpsTime time_of_week(const RecordAt& at, double week, double tow_s) {
  if (week != std::floor(week) || !(week >= 0 && week < 10'000)) {
    throw at.error(fmt::format("the GPS week '{}' is not a whole number of weeks since 1980", week));
  }
  if (!(tow_s >= 0 && tow_s < static_cast<double>(GpsTime::kSecondsPerWeek))) {
    throw at.error(fmt::format("the time of week {} s is out of range", tow_s), "it runs from 0 to 604800 s");
  }
  return GpsTime::from_week(static_cast<int>(week), tow_s);
}

GpsTime time_of_text(const RecordAt& at, std::string_view text) {
  try {
    const GpsTime time = geodesy::parse_simulated_time(text);
    if (!geodesy::names_time_scale(text)) at.report.guess(at.line, "time without a zone", "taken as UTC");
    return time;
  } catch (const InputError& e) {
    throw at.error(e.problem(), e.cure());
  }
}

double from_sea_level(const RecordAt& at, double height_m, std::string_view of,
                      const HeightReading& heights) {
  if (heights.needed) {
    at.report.guess(
        at.line, of,
        heights.geoid_undulation_m != 0
            ? fmt::format("the city's geoid undulation, {:.1f} m, is added", heights.geoid_undulation_m)
            : "taken as ellipsoidal; city.geoid_undulation_m corrects it, height_above_terrain_m does "
              "without it");
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
  if (!recorded.timed) {
    throw InputError(path, 0, "the path has no times", "name it in a scenario, with trajectory.speed_mps");
  }
  return recorded_trajectory(std::move(recorded));
}

}  // namespace canyon::simulation
