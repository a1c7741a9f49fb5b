#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "canyon/analysis/validation/key_metrics.hpp"

// Recorded metrics and the distribution of simulated ones, over samples of the unknowns.

namespace canyon::validation {

/// A recording and its simulations.
struct EnsembleRow {
  std::string name;
  std::string part;                   ///< describe_part()
  std::vector<std::string> unknowns;  ///< sampled parameters: "level: -10 to 6 dB, uniform"
  std::vector<KeyMetric> point;       ///< with the settings as they are
  struct EnsembleSample {
    std::map<std::string, double> values;  ///< of the unknowns
    std::vector<KeyMetric> key_metrics;    ///< in the order of `point`
  };
  std::vector<EnsembleSample> samples;
};

/// A metric of both recording and simulations.
struct EnsembleMetric {
  MetricInfo info;
  double recorded = 0;
  std::optional<double> point;  ///< simulated with the settings as they are
  double median = 0;
  Interval half, maximum;  ///< 50 and 90 %
  /// Weighted interval scores of the samples' distribution and of the point, in units of the metric's range
  /// (KeyMetric::distance()); empty for a metric without a range.
  std::optional<double> score, point_score;

  [[nodiscard]] bool within_half() const { return half.low <= recorded && recorded <= half.high; }
  [[nodiscard]] bool within_most() const { return maximum.low <= recorded && recorded <= maximum.high; }
};
/// The metrics of a row, without those that are not recorded or that fewer than two samples have.
///
/// Quantiles are predictive_quantile(): an n + 1st sample is in an interval with its probability.
///
/// Weighted interval score (Bracher et al., PLOS Computational Biology 17(2), 2021) of median and both
/// intervals:
///   (|x - m| / 2 + sum over a in {0.5, 0.1} of a / 2 (u - l) + max(l - x, 0) + max(x - u, 0)) / 2.5.
/// A point forecast scores its distance |x - m|; less is better.
[[nodiscard]] std::vector<EnsembleMetric> ensemble_metrics(const EnsembleRow& row);

/// Sums over metrics of all rows.
struct Coverage {
  std::size_t metrics = 0, within_half = 0, within_most = 0;
  double score = 0, point_score = 0;  ///< means; 0 without metrics
  std::size_t scored = 0;
  double widest_p50 = 0;  ///< largest ratio of the ends of the 90 % interval of horizontal p50; 0: none
};
[[nodiscard]] Coverage coverage(const std::vector<EnsembleRow>& rows);

/// For terminals: for each row the sampled parameters and its table of metrics, then coverage with its goals.
[[nodiscard]] std::string ensemble_text(const std::vector<EnsembleRow>& rows);
/// The metrics, the values of all samples, and the coverage.
[[nodiscard]] std::string ensemble_json(const std::vector<EnsembleRow>& rows);

}  // namespace canyon::validation
