#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canyon/analysis/validation/comparison.hpp"
#include "canyon/analysis/validation/statistics.hpp"

namespace canyon::validation {

/// p5, p25, p50, p75, p95.
inline constexpr std::array<double, 5> kQuantiles{0.05, 0.25, 0.5, 0.75, 0.95};

/// Quantiles of no values: NaN.
inline constexpr std::array<double, 5> kNoQuantiles = [] {
  std::array<double, 5> none{};
  none.fill(std::numeric_limits<double>::quiet_NaN());
  return none;
}();

/// Values of one quantity.
struct QuantileSummary {
  std::size_t n = 0;
  std::array<double, 5> at = kNoQuantiles;  ///< kQuantiles
};
struct DistributionPair : MeasuredAndSimulated<QuantileSummary> {
  std::optional<double> ks;  ///< Kolmogorov-Smirnov distance
};

/// LOS or NLOS satellites (in the city) above the mask, and how many of them are tracked.
struct TrackedFraction : MeasuredAndSimulated<std::size_t> {
  std::size_t satellites = 0;
  [[nodiscard]] std::optional<double> ratio(Side side) const;  ///< empty without satellites
};

/// Satellites and observations of one signal, by visibility in the city.
struct ObservationMetrics {
  TrackedFraction tracked_los, tracked_nlos;  ///< of satellites that send it
  DistributionPair error_los_m, error_nlos_m, cn0_los_dbhz, cn0_nlos_dbhz;
};

/// NLOS observations explained by paths of one kind and order ("all": of any).
struct Explained {
  std::string kind;  ///< "reflected 1", "reflected 2", "diffracted", "diffuse", "all"
  std::size_t n = 0;
  double fraction = 0;                         ///< of all tracked (measured) NLOS observations
  std::optional<double> median_difference_m;   ///< |measured error - predicted code delay|
  std::optional<RankCorrelation> correlation;  ///< Spearman
};

struct Band {
  double low_deg = 0, high_deg = 90;
  std::size_t los = 0, nlos = 0;
  std::optional<Separation> by_cn0, by_error;
};

struct PositionMetrics {
  std::size_t epochs = 0, fixes = 0;
  /// Satellites, over epochs with a fix; NaN without.
  double mean_used = std::numeric_limits<double>::quiet_NaN();
  std::array<double, 5> horizontal_m = kNoQuantiles, vertical_m = kNoQuantiles;  ///< vertical without sign
  std::size_t reported = 0;  ///< fixes with a reported accuracy
  /// Fractions of these with an error of at most once and at most twice the reported deviation (ComparedFix).
  std::array<double, 2> horizontal_within{}, vertical_within{};
};

/// Carrier phases of one signal, LOS or NLOS.
struct PhaseView {
  std::size_t observations = 0, with_phase = 0;  ///< pseudoranges above the mask, and those with a phase
  /// Standard deviation of the phase's noise [m], from noise_n third differences in time:
  ///   d_t = l_t - 3 l_(t-1) + 3 l_(t-2) - l_(t-3), l = phase minus range, satellite clock and atmosphere,
  /// over four epochs of the recording's interval without a slip between them. White noise of deviation s
  /// gives d the deviation s sqrt(20). The receiver's clock and an error of the antenna's position add a +
  /// e.b to all d of an epoch, with e the direction to the satellite. This is removed: a and b by least
  /// squares, weighted by C/N0 and Huber's function. Each remainder is divided by sqrt(1 - h), h its
  /// leverage, and sqrt(20); the result is 1.4826 times their median magnitude. Epochs with fewer than seven
  /// d are left out.
  std::optional<double> noise_m;
  std::size_t noise_n = 0;
  [[nodiscard]] std::optional<double> fraction()
      const;  ///< fraction with a phase; empty without observations
};
struct PhaseMetrics {
  PhaseView los, nlos;
  /// Phases that do not continue the signal's previous one: reported by the receiver, or after an epoch
  /// without phase.
  std::size_t slips = 0;
  double time_s = 0;  ///< with a phase: their count times the recording's interval
  [[nodiscard]] std::optional<double> time_between_slips_s() const;  ///< time_s / slips; empty without slips
};

/// One signal of one system. Has no observations unless it is both recorded and tracked.
struct SignalMetrics : ObservationMetrics {
  const gnss::Signal* signal = nullptr;
  bool recorded = false, tracked = false;    ///< Comparison::recorded, tracked
  MeasuredAndSimulated<PhaseMetrics> phase;  ///< of several runs: pooled
  [[nodiscard]] bool judged() const { return recorded && tracked; }
  [[nodiscard]] std::string name() const;  ///< "GPS L2C"
  [[nodiscard]] bool first() const;        ///< the one near L1, to which the other metrics refer
};

struct SegmentMetrics {
  std::size_t street = 0;  ///< number of the whole recording's segment, from 1
  StreetSegment segment;
  MeasuredAndSimulated<PositionMetrics> position;
};

/// All metrics of `canyon validate` of one model on one part of a recording. Measured observations are those
/// with an error: not gross, at an epoch with a clock.
struct ModelMetrics : ObservationMetrics {  ///< of each system's first signal
  std::string model;
  std::string part;  ///< "second half: 12:52:00 to 12:56:24 GPST, 243 epochs"
  std::size_t epochs = 0;
  std::size_t runs = 1;                        ///< number of runs of the simulated values
  std::size_t los = 0, nlos = 0;               ///< measured observations by visibility in the city
  std::optional<Separation> by_cn0, by_error;  ///< NLOS: weak; late
  std::optional<Interval> by_cn0_interval, by_error_interval;  ///< 95 %, blocks of time
  std::vector<Band> bands;                                     ///< 10-30, 30-50, 50-90 deg
  std::vector<Explained> explained;                            ///< the last one is "all"
  DistributionPair used;                                       ///< satellites in fixes
  /// Correlation of the numbers of satellites with a first signal, measured and simulated, over epochs where
  /// both have some.
  std::optional<RankCorrelation> tracked_over_time;
  MeasuredAndSimulated<PositionMetrics> position;  ///< of single epochs
  MeasuredAndSimulated<PositionMetrics> filtered;  ///< no epochs if the receiver has no filter
  std::vector<SegmentMetrics> segments;            ///< of at least 10 epochs
  std::vector<SignalMetrics> signals;              ///< by system, then in the order of gnss::signals_of()
  /// Positions that the recorded receiver reported by NMEA; its satellites are not known: mean_used is NaN.
  std::optional<PositionMetrics> reported_fixes;
  std::vector<NeverTracked> never_tracked;  ///< in the whole recording; set by the caller of never_tracked()
  bool left_out = false;                    ///< they are removed: CompareOptions::leave_out
};

struct MetricOptions {
  /// Blocks of the bootstrap [s]: errors are correlated over the length of a building. [1, 600]; at most a
  /// fifth of the part.
  double block_s = 60;
  int resamples = 500;  ///< [100, 100,000]; 0: no intervals
  std::uint64_t seed = 1;
};
/// Names the part of a comparison: "second half: 12:52:00 to 12:56:24 GPST, 243 epochs".
[[nodiscard]] std::string describe_part(const Comparison& comparison, std::size_t first, std::size_t count,
                                        const std::string& name);

/// Metrics of a comparison's epochs [first, first + count) (asserted to exist). Measured errors count in
/// epochs that have a clock. Bands' upper ends are open except at the zenith. @param runs of the same
/// recording and satellites, for example in cities moved within their position's uncertainty. If there are
/// any, the simulated values are pooled over them, while measured values, LOS and NLOS, and explanations of
/// observations are `comparison`'s.
[[nodiscard]] ModelMetrics metrics(const Comparison& comparison, std::size_t first, std::size_t count,
                                   const std::string& part, const MetricOptions& options = {},
                                   std::span<const Comparison> runs = {});

/// Metrics of Recording::reported_fixes in the epochs [first, first + count) of a comparison of that
/// recording, first and last time included.
[[nodiscard]] PositionMetrics reported_fix_metrics(const Recording& recording, const Comparison& comparison,
                                                   std::size_t first, std::size_t count);

/// Epochs [first, first + count) of one recording, and the runs of its simulated values, if any.
struct PooledPart {
  const Comparison* comparison = nullptr;
  std::size_t first = 0, count = 0;
  std::span<const Comparison> runs;
};
/// All recordings concatenated, as one comparison without streets, for metrics() of all observations.
/// Recordings of a shorter interval are decimated to the longest of all, so that a second weighs the same in
/// each; if a recording has fewer runs than another, its runs are repeated.
struct Pooled {
  Comparison comparison;
  std::vector<Comparison> runs;
};
[[nodiscard]] Pooled pool(std::span<const PooledPart> parts);

/// "reflected 1", "reflected 2", "diffracted", "diffuse": the words of Explained::kind.
[[nodiscard]] std::string path_words(const ComparedSatellite::Prediction& prediction);

}  // namespace canyon::validation
