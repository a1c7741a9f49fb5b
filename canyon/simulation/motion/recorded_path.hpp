#pragma once

#include <string_view>
#include <vector>

#include "canyon/base/record_notes.hpp"
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
/// The same for a height, also by -999, 9999, 99999 and 999999.
[[nodiscard]] bool is_missing_height(std::string_view text);

/// Leaves out the fewest points so that times rise strictly: one wrong time costs one point. Points more than
/// 100 days from the median time go first (a receiver's default date). The first of several points at one
/// instant stays; a warning says where they are not at one place. Throws InputError where more than half of
/// the points would go because their times fall.
void keep_rising(RecordedPoints& points, RecordNotes& notes);

/// Leaves out positions that no vehicle can reach, in points whose times rise: latitude 0, longitude 0 in a
/// path elsewhere; short stretches that are reached and left at more than 1,000 m/s while the points around
/// them agree; and single points off the way from the one before to the one behind by more than 15 m, ten
/// times the file's median, and what 20 m/s^2 explain, where the others around it lie on one way. The first
/// and the last point may be off by twice that.
void leave_out_strays(RecordedPoints& points, RecordNotes& notes);

/// The reason why these points are left out.
inline constexpr std::string_view kZeroPlace =
    "point at latitude 0, longitude 0, which receivers without a fix report";
/// Marks positions at latitude 0, longitude 0 in a path elsewhere: receivers without a fix report that.
[[nodiscard]] std::vector<bool> zero_places(const std::vector<geodesy::Geodetic>& places);

/// The path of recorded points after keep_rising() and leave_out_strays(), with notes about pauses, heights
/// above 50 km and times that may be in another unit. Throws InputError where half of the steps or more are
/// faster than any vehicle's: coordinates or times are in another unit. Precondition: at least one point.
[[nodiscard]] TrajectoryFile recorded_trajectory(RecordedPoints points, bool has_own_dates,
                                                 RecordNotes notes);

}  // namespace canyon::simulation
