#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/outputs/drawing/canvas.hpp"

namespace canyon::drawing {

/// One epoch of a run.
struct TimelinePoint {
  geodesy::GpsTime time;
  double error_m = std::numeric_limits<double>::quiet_NaN();     ///< horizontal; NaN: no fix
  double vertical_m = std::numeric_limits<double>::quiet_NaN();  ///< absolute; NaN: no fix
  double hdop = std::numeric_limits<double>::quiet_NaN();        ///< NaN: no fix
  int used = 0;                                                  ///< in the fix
  int visible = 0;                                               ///< tracked, above the mask
  int blocked = 0;                                               ///< above the mask, not tracked
  /// Mean C/N0 of the measurements [dB-Hz], of signals with and without a direct path; NaN: no such signals.
  double cn0_los_dbhz = std::numeric_limits<double>::quiet_NaN();
  double cn0_nlos_dbhz = std::numeric_limits<double>::quiet_NaN();
};

/// A fault of the run: the first and the last epoch of each interval during which it was active.
struct TimelineFault {
  std::string name;
  std::vector<std::pair<geodesy::GpsTime, geodesy::GpsTime>> stretches;
};

struct TimelineDrawing {
  std::string title;
  std::string subtitle;
  std::vector<TimelinePoint> points;       ///< ascending in time; not empty
  std::vector<TimelineFault> faults = {};  ///< a row of bands each, kMaxFaultRows at most
};

inline constexpr std::size_t kMaxFaultRows = 12;

/// Faults by name, if there are any; below them horizontal and vertical error, satellites (used, tracked
/// but unused, not tracked; stacked) and HDOP over UTC, and below them C/N0 if any point has one (which makes
/// the picture higher). Intervals without a fix are shaded. If a run has more epochs than fit, each column
/// shows the range from smallest to largest value.
[[nodiscard]] Picture draw_timeline(const TimelineDrawing& drawing);

}  // namespace canyon::drawing
