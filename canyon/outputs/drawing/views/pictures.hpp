#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/outputs/drawing/canvas.hpp"
#include "canyon/run/samples/correlation_record.hpp"
#include "canyon/run/simulator.hpp"

namespace canyon::drawing {

/// Pictures of a run, drawn with Cairo, readable by colour-blind people. Part of canyon::io.
/// `track.png`/`track.svg`: the city from above (buildings shaded by height), true track, fixes coloured by
/// horizontal error with colour bar, places without fix, scale bar, north arrow.
/// `skyplot.png`/`.svg`: satellites at the run's middle epoch, tracks over the run, coloured and shaped by
/// visibility, with the building silhouette (sky mask) at that place. `timeline.png`/`.svg`: horizontal
/// error, satellites (used, tracked, not tracked), HDOP and, where signals have strength, C/N0 over time.
///
/// Epochs of other receivers are passed over. The files appear together at finish(), none where there was no
/// epoch. Throws InputError where `folder` is missing or cannot be written to (found here, before the run).
/// `simulation` must outlive the sink. `receiver` is an index into its scenario's receivers.
/// @param stop nothing is drawn where it is set at finish(): drawing takes about a second
[[nodiscard]] std::unique_ptr<simulation::EpochSink> make_pictures(const simulation::Simulation& simulation,
                                                                   const std::filesystem::path& folder,
                                                                   std::size_t receiver,
                                                                   const std::atomic<bool>* stop = nullptr);

/// Two panels: the magnitude of the correlation over time and delay, with the measured detour as a line; and
/// the instant with the largest measured detour (without any, the middle): the sum, and each path by itself.
/// @param shape that the series was made with. A series without an instant gives a notice.
[[nodiscard]] Picture draw_correlation(const samples::CorrelationSeries& series,
                                       const tracking::Correlation& shape);

/// One epoch of a run.
struct TimelinePoint {
  geodesy::GpsTime time;
  double error_m = std::numeric_limits<double>::quiet_NaN();     ///< horizontal; NaN: no fix
  double vertical_m = std::numeric_limits<double>::quiet_NaN();  ///< absolute; NaN: no fix
  double hdop = std::numeric_limits<double>::quiet_NaN();        ///< NaN: no fix
  int used = 0;                                                  ///< in the fix
  int visible = 0;                                               ///< tracked, above the mask
  int blocked = 0;                                               ///< above the mask, not tracked
  /// Mean C/N0 of the measurements [dB-Hz], of signals with a direct path and without; NaN: there are none.
  double cn0_los_dbhz = std::numeric_limits<double>::quiet_NaN();
  double cn0_nlos_dbhz = std::numeric_limits<double>::quiet_NaN();
};

/// A fault of the run: the first and the last epoch of each stretch at which it was at work.
struct TimelineFault {
  std::string name;
  std::vector<std::pair<geodesy::GpsTime, geodesy::GpsTime>> stretches;
};

struct TimelineDrawing {
  std::string title;
  std::string subtitle;
  std::vector<TimelinePoint> points;       ///< ascending in time; not empty
  std::vector<TimelineFault> faults = {};  ///< a row of bands each, kMostFaultRows at most
};

inline constexpr std::size_t kMostFaultRows = 12;

/// Faults by name, where there are any; below them horizontal and vertical error, satellites (used, tracked
/// but unused, not tracked; stacked) and HDOP over UTC, and below them C/N0 where any point has one: then the
/// picture is higher. Stretches without a fix are shaded. Runs of more epochs than fit are drawn column by
/// column, from smallest to largest value.
[[nodiscard]] Picture draw_timeline(const TimelineDrawing& drawing);

}  // namespace canyon::drawing
