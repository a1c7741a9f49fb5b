#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/heatmap/engine/route_report.hpp"
#include "canyon/validation/comparison.hpp"
#include "canyon/validation/statistics.hpp"

// A heat map beside a recorded receiver: what the map says at the places of a drive, and how wrong the
// recorded fixes there were.

namespace canyon::validation {

/// One recorded epoch over the map. The map's values are NaN where it has none.
struct MapEpoch {
  geodesy::GpsTime time;
  double way_m = 0;                               ///< gone since the first epoch
  bool known = false;                             ///< the map has a computed cell there, and then
  bool solved = false;                            ///< the recorded receiver has a fix
  double error_m = 0;                             ///< its horizontal error; NaN without a fix
  double p50_m = 0, p95_m = 0, availability = 0;  ///< of the map
};
/// Looks the epochs [first, first + count) of a comparison up. @param frame of the map @param city of the
/// comparison's places @param layers of the map; horizontal_error_p50 and _p95 are needed (InputError)
/// @param altitude_m as the map counts; empty: each epoch's height above the ellipsoid
[[nodiscard]] std::vector<MapEpoch> map_epochs(const Comparison& comparison, std::size_t first,
                                               std::size_t count, const geodesy::LocalFrame& city,
                                               const heatmap::MapLookup& map,
                                               const geodesy::LocalFrame& frame,
                                               const std::vector<heatmap::Layer>& layers,
                                               std::optional<double> altitude_m);

/// A share or length with its 95 % interval; the interval is NaN where there is too little for one.
struct JudgedValue {
  double value = 0, low = 0, high = 0;
};
/// Epochs with a recorded fix and the map's errors.
struct MapStratum {
  std::string name;  ///< "all", "map's best third", ...
  std::size_t epochs = 0;
  JudgedValue within_p50, within_p95;             ///< shares of recorded errors up to the map's
  double recorded_p50_m = 0, recorded_p95_m = 0;  ///< quantiles of the recorded errors
  double map_p50_m = 0, map_p95_m = 0;            ///< medians over the places of the map's quantiles
};
struct MapJudgement {
  std::size_t epochs = 0, known = 0;                       ///< of the drive; in computed cells
  std::size_t judged = 0;                                  ///< with a recorded fix and the map's errors
  double recorded_availability = 0, map_availability = 0;  ///< over known epochs; NaN where unknown
  std::vector<MapStratum> strata;  ///< all, and thirds by the map's 95 %; empty where `judged` is 0
  /// Spearman's of the map's 95 % and the recorded errors; its interval takes epochs as independent.
  std::optional<Correlation> correlation;
};
/// Intervals are percentile bootstrap intervals over blocks of a minute (a fifth of the epochs at most),
/// drawn with replacement: errors next to each other are correlated. 1,000 resamples, the same for the same
/// epochs.
[[nodiscard]] MapJudgement judge_map(const std::vector<MapEpoch>& epochs);

/// Tables for terminals.
[[nodiscard]] std::string to_text(const MapJudgement& judgement);
/// A line for each epoch.
[[nodiscard]] std::string to_csv(const std::vector<MapEpoch>& epochs);

}  // namespace canyon::validation
