#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/options/fwd.hpp"

namespace canyon::bench {

/// What an estimator says, or what is true, by time.
struct Track {
  std::vector<double> time_s;          ///< since the drive's begin, rising
  std::vector<Eigen::Vector3d> enu_m;  ///< of the drive's first place; up is NaN where no height is given
  std::vector<double> heading_deg;     ///< from north, clockwise; NaN where it is not given
  std::vector<Eigen::Matrix2d> covariance;  ///< of east and north [m^2]; NaN where it is not given
};

/// A fault's time, or a lasting error of the fix.
struct Event {
  double start_s = 0, end_s = 0;
  std::string kind;
  Eigen::Vector2d bias_m;  ///< mean error of the fixes, east and north; NaN without fixes
};

/// A drive's folder, read.
struct DriveFolder {
  std::filesystem::path folder;
  std::string name;
  double begin_unix_s = 0;
  geodesy::LocalFrame frame;
  Track truth, fixes;
  std::vector<Event> events;
};
/// Throws InputError for a folder that `canyon bench make` did not write.
[[nodiscard]] DriveFolder read_drive(const std::filesystem::path& folder);
/// Folders of drives in a bench, by name. Throws InputError where there is none.
[[nodiscard]] std::vector<std::filesystem::path> drives_in(const std::filesystem::path& bench);

/// An estimate: CSV with a header (time_s or unix_s, latitude_deg, longitude_deg, and perhaps height_m,
/// heading_deg, cov_ee_m2, cov_en_m2, cov_nn_m2), or TUM ("stamp x y z qx qy qz qw", metres east, north and
/// up of the drive's first place). Times count from the drive's begin or from 1970. Throws InputError naming
/// file, line and cure.
[[nodiscard]] Track read_estimate(const std::filesystem::path& path, const DriveFolder& drive);

/// Name and file of "NAME=FILE", where {drive} in FILE stands for the drive's name. Throws InputError, naming
/// the option, for other texts.
[[nodiscard]] std::pair<std::string, std::filesystem::path> named_file(const std::string& text,
                                                                       const std::string& option,
                                                                       const DriveFolder& drive);

/// Where a track is at a time, between its neighbours [m, of the drive's first place]; NaN where it has no
/// line within 0.5 s, up where it has no heights.
[[nodiscard]] Eigen::Vector3d place_at(const Track& track, double time_s);

/// What became of an event in an estimate.
struct EventScore {
  Event event;
  std::optional<double> followed;    ///< share of the fixes' mean error that the estimate has; empty: it is
                                     ///< below 2.5 m, or of the whole drive
  double largest_m = 0;              ///< error of the estimate from its start to 5 s behind its end
  bool over = true;                  ///< it ends before the drive does
  std::optional<double> recovery_s;  ///< from its end until the error stays below recovered_m for 2 s
};

/// Figures of an estimate, by the field's words; horizontal errors at the times of the truth.
struct Score {
  double availability = 0;  ///< share of the times with an estimate within 0.5 s
  double p50_m = 0, p95_m = 0, rmse_m = 0, largest_m = 0;  ///< ATE
  double rpe_1s_m = 0, rpe_10s_m = 0;                      ///< RPE: RMS of errors of the way in 1 and 10 s
  std::optional<double> nees, within_95;  ///< mean e' P^-1 e [1], 2 if honest; share inside the 95 % ellipse
  std::optional<double> misleading;  ///< share of errors beyond the bound that a probability of 1e-4 states
  std::optional<double> heading_p95_deg;
  double longest_divergence_s = 0;  ///< longest time in which fixes are good and the estimate is not
  std::vector<EventScore> events;
};

/// What an estimate must meet.
struct Limits {
  std::optional<double> p50_m, p95_m, largest_m, availability, followed, recovery_s, divergence_s, within_95;
  std::vector<std::string> drives;  ///< that they hold for; empty: all
};
/// A file of limits.
struct LimitsFile {
  double recovered_m = 5;  ///< an error below it is a good one
  std::vector<Limits> limits;
};
void visit(options::Visitor& v, LimitsFile& file);
/// `limits: [{...}, ...]`. Throws InputError.
[[nodiscard]] LimitsFile read_limits(const std::filesystem::path& path);

[[nodiscard]] Score score(const DriveFolder& drive, const Track& estimate, double recovered_m);
/// "p95 is 12.1 m, limit 10": what of a score the limits do not allow.
[[nodiscard]] std::vector<std::string> violations(const std::string& drive, const Score& score,
                                                  const std::vector<Limits>& limits);

/// A row of results.
struct Result {
  std::string drive, estimate;
  Score score;
  std::vector<std::string> violations;
};
[[nodiscard]] Json to_json(const std::vector<Result>& results);
[[nodiscard]] std::string to_junit(const std::vector<Result>& results);

/// The bound beyond which errors mislead, in stated deviations: exceeded with a probability of 1e-4.
[[nodiscard]] double misleading_bound();

/// Distance of an estimate from the truth, at its times, horizontally [m]; NaN without estimate.
[[nodiscard]] std::vector<double> errors_over_time(const DriveFolder& drive, const Track& estimate);

}  // namespace canyon::bench
