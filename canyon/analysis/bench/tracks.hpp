#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"

// Drives and estimates as files: docs/bench.md.

namespace canyon::bench {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Positions over time: the truth, the fixes, or an estimate.
struct Track {
  std::vector<double> time_s;          ///< since the drive's begin, increasing
  std::vector<Eigen::Vector3d> enu_m;  ///< of the drive's first true position; up is NaN without a height
  std::vector<double> heading_deg;     ///< from north, clockwise; NaN if not given
  std::vector<Eigen::Matrix2d>
      covariance;  ///< of east and north [m^2], none negative; NaN if it is not given
};

/// The time of a fault, or of a lasting error of the fix.
struct Event {
  double start_s = 0, end_s = 0;
  std::string kind;
  Eigen::Vector2d bias_m;  ///< mean error of the fixes, east and north; NaN without fixes
  /// The data that contain it, of kInputs; empty: not known (drives of edition 1).
  std::vector<std::string> inputs;
};
/// Data of a drive that an estimator can read.
inline constexpr const char* kInputs[]{"fixes", "raw", "imu", "wheels"};

struct DriveFolder {
  std::filesystem::path folder;
  std::string name;
  int edition = 1;
  std::string without_fault;  ///< name of the drive that differs only by the fault; empty: none
  double begin_unix_s = 0;
  geodesy::LocalFrame frame;
  Track truth, fixes;
  std::vector<Event> events;
};
/// Throws InputError for a folder that `canyon bench make` did not write.
[[nodiscard]] DriveFolder read_drive(const std::filesystem::path& folder);
/// Folders of drives in a bench, by name. Throws InputError if there is none.
[[nodiscard]] std::vector<std::filesystem::path> drives_in(const std::filesystem::path& bench);

/// An estimate: CSV with a header (time_s or unix_s, latitude_deg, longitude_deg, and perhaps height_m,
/// heading_deg, cov_ee_m2, cov_en_m2, cov_nn_m2), or TUM ("stamp x y z qx qy qz qw", metres east, north and
/// up of the drive's first true position). Times count from the drive's begin or from 1970. Throws InputError
/// with file, line and hint, also if a position is 1,000 km away, a covariance is not positive semidefinite,
/// most times are outside the drive, or there are over 1,000 rows for a second of the drive.
[[nodiscard]] Track read_estimate(const std::filesystem::path& path, const DriveFolder& drive);

/// A text with each "{key}" replaced by its value, in one pass: values may contain "{key}".
[[nodiscard]] std::string filled(const std::string& text, const std::map<std::string, std::string>& values);
/// Throws InputError for a name that is not letters, digits, '-', '_' and '.'.
void check_estimate_name(const std::string& name, const std::string& option);
struct NamedFile {
  std::string name, file;
};
/// "NAME=FILE". Throws InputError, naming the option, for other texts and check_estimate_name().
[[nodiscard]] NamedFile named_file(const std::string& text, const std::string& option);

/// A track at a time.
struct TrackPoint {
  Eigen::Vector3d enu_m = Eigen::Vector3d::Constant(kNan);
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Constant(kNan);
  double heading_deg = kNan;
};
/// Linear between the two rows next to a time, so that it is continuous in their times; NaN farther than
/// 0.75 s from both, and outside all rows (by more than 0.1 s; there the nearest row counts).
[[nodiscard]] TrackPoint point_at(const Track& track, double time_s);

}  // namespace canyon::bench
