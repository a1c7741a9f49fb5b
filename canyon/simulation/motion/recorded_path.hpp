#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {

/// Positions with their times, in the order of a file.
using RecordedPoints = std::vector<std::pair<geodesy::GpsTime, geodesy::Geodetic>>;

/// Whether a recorder says by this text that it has no value: nothing, a word such as nan, or a fill value
/// (-9999, -99999, -32768, 32767, above 1e19, and 2^31 - 1 in units of 1e-7 of MAVLink and UBX).
[[nodiscard]] bool is_missing(std::string_view text);

/// Warnings about one file: how many of its records, and why.
class FileNotes {
 public:
  explicit FileNotes(std::filesystem::path path) : path_(std::move(path)) {}
  /// Nothing where `count` is 0.
  void say(std::size_t count, std::string_view what);
  void say(std::string_view what);
  /// A warning that already names file and line.
  void warn(std::string warning) { warnings_.push_back(std::move(warning)); }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::vector<std::string> take() { return std::move(warnings_); }

 private:
  std::filesystem::path path_;
  std::vector<std::string> warnings_;
};

/// Leaves out the fewest points so that times rise strictly: one wrong time costs one point. Points more than
/// 100 days from the median time go first (a receiver's default date). Of points at one instant the first
/// stays. Throws InputError where more than half of the points would go because their times fall.
void keep_rising(RecordedPoints& points, FileNotes& notes);

/// Leaves out positions that no vehicle can reach, in points whose times rise: latitude 0, longitude 0 in a
/// path elsewhere, and short stretches that are reached and left at more than 1,000 m/s while the points
/// around them agree.
void leave_out_strays(RecordedPoints& points, FileNotes& notes);

/// The path of recorded points after keep_rising() and leave_out_strays(), with notes about pauses and
/// heights above 50 km. Precondition: at least one point.
[[nodiscard]] TrajectoryFile recorded_trajectory(RecordedPoints points, bool has_own_dates, FileNotes notes);

}  // namespace canyon::simulation
