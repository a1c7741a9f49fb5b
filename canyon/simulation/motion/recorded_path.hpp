#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {

/// A position with its time.
struct RecordedPoint {
  geodesy::GpsTime time;
  geodesy::Geodetic place;
  int line = 0;  ///< of its file
};
/// In the order of a file.
using RecordedPoints = std::vector<RecordedPoint>;

/// Whether a recorder says by this text that it has no value: nothing, a word such as nan, or a fill value
/// (-9999, -99999, -32768, 32767, above 1e19, and 2^31 - 1 in units of 1e-7 of MAVLink and UBX).
[[nodiscard]] bool is_missing(std::string_view text);

/// How many records of a file, and the line of the first.
struct Counted {
  std::size_t count = 0;
  int line = 0;

  void add(int of_line) {
    if (count++ == 0) line = of_line;
  }
};

/// Warnings about one file: how many of its records, and why.
class FileNotes {
 public:
  explicit FileNotes(std::filesystem::path path) : path_(std::move(path)) {}
  /// Nothing where `count` is 0.
  void say(std::size_t count, std::string_view what);
  void say(const Counted& counted, std::string_view what);
  void say(std::string_view what);
  /// A warning that already names file and line.
  void warn(std::string warning) { warnings_.push_back(std::move(warning)); }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::vector<std::string> take() { return std::move(warnings_); }

 private:
  std::filesystem::path path_;
  std::vector<std::string> warnings_;
};

/// Records of a file with a value that cannot be: each costs itself, not the file.
class BadRecords {
 public:
  void add(const InputError& error, std::size_t count = 1);
  /// Calls `read`; a record that it refuses by an InputError counts as bad.
  template <typename Read>
  void guard(const Read& read) {
    try {
      read();
    } catch (const InputError& error) {
      add(error);
    }
  }
  /// One warning with the first fault, its line and the number. Throws the first fault where no more than
  /// half of the records are good: then the file is not what it is taken for.
  void say(std::size_t good, FileNotes& notes) const;
  [[nodiscard]] const std::optional<InputError>& first() const { return first_; }
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  std::optional<InputError> first_;
  std::size_t count_ = 0;
};

/// Leaves out the fewest points so that times rise strictly: one wrong time costs one point. Points more than
/// 100 days from the median time go first (a receiver's default date). Of points at one instant the first
/// stays; a warning says where they are not at one place. Throws InputError where more than half of the
/// points would go because their times fall.
void keep_rising(RecordedPoints& points, FileNotes& notes);

/// Leaves out positions that no vehicle can reach, in points whose times rise: latitude 0, longitude 0 in a
/// path elsewhere; short stretches that are reached and left at more than 1,000 m/s while the points around
/// them agree; and single points off the way from the one before to the one behind by more than 15 m, ten
/// times the file's median, and what 20 m/s^2 explain, where the others around it lie on one way. The first
/// and the last point may be off by twice that.
void leave_out_strays(RecordedPoints& points, FileNotes& notes);

/// Marks positions at latitude 0, longitude 0 in a path elsewhere: receivers without a fix report that.
[[nodiscard]] std::vector<bool> zero_places(const std::vector<geodesy::Geodetic>& places);

/// The path of recorded points after keep_rising() and leave_out_strays(), with notes about pauses and
/// heights above 50 km. Precondition: at least one point.
[[nodiscard]] TrajectoryFile recorded_trajectory(RecordedPoints points, bool has_own_dates, FileNotes notes);

}  // namespace canyon::simulation
