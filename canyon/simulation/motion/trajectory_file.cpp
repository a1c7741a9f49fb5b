// Declared in canyon/simulation/motion/trajectory.hpp.
// The formats of recorded paths.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"
#include "canyon/simulation/motion/track_readers.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {

using geodesy::GpsTime;

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

Trajectory read_trajectory(const std::filesystem::path& path, const std::string& format, GpsTime start) {
  return read_trajectory_file(path, format, start).trajectory;
}

}  // namespace canyon::simulation
