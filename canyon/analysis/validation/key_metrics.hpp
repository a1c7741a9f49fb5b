#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/analysis/validation/metrics.hpp"

// The key metrics of a recording: one table has their names, values and ranges, for tables of recordings and
// models and for the score card.

namespace canyon::validation {

/// The expected range of a simulated metric.
struct MetricRange {
  enum class Of { Nothing, Value, Difference, Ratio };  ///< relative to the recorded metric

  Of of = Of::Nothing;
  double low = 0;  ///< of a ratio; of a value that of a perfect simulation
  double end = 0;
  std::string_view unit = {};  ///< after a number: " m"

  /// The value, difference or ratio; empty if there is no range or a metric is missing.
  [[nodiscard]] std::optional<double> compared(const std::optional<double>& measured,
                                               const std::optional<double>& simulated) const;
  /// Distance of a compared() value from a perfect simulation, in units of the range: up to 1 inside it.
  /// Signed for differences and ratios (of their logarithm), for others from 0.
  [[nodiscard]] double distance(double compared) const;
  /// "at most 0.2", "0.7 to 1.4", "at least 80 %".
  [[nodiscard]] std::string text() const;
};

/// A metric, and the range that the score card compares it with (docs/results.md).
struct MetricInfo {
  enum class Kind {
    OfModel,       ///< only in the table of models, not a key metric
    Both,          ///< one value of measured and simulated together, such as a distance
    Pair,          ///< one value measured, one simulated
    ReportedFixes  ///< as Pair, in recordings with reported fixes
  };
  using Value = std::optional<double> (*)(const ModelMetrics& metrics, Side side);

  std::string_view key, title;
  int decimals = 1;
  Kind kind = Kind::Both;
  Value value = nullptr;
  MetricRange range = {};
};
/// All, in the order of tables.
[[nodiscard]] std::span<const MetricInfo> metric_infos();
/// Null if there is no such metric.
[[nodiscard]] const MetricInfo* metric_info(std::string_view key);

/// A key metric of a recording in a table of several.
struct KeyMetric {
  MetricInfo info;
  std::optional<double> measured, simulated;  ///< without pair(): `simulated` has the value of both together
  std::optional<Interval> measured_interval, simulated_interval;  ///< 95 %, blocks of time

  /// Whether recorded and simulated have one each.
  [[nodiscard]] bool pair() const {
    return info.kind == MetricInfo::Kind::Pair || info.kind == MetricInfo::Kind::ReportedFixes;
  }
  /// MetricRange::distance() of the metric; empty without a range, and if a value is missing.
  [[nodiscard]] std::optional<double> distance() const;
  /// Whether it is in its range (docs/results.md has them); empty as distance().
  [[nodiscard]] std::optional<bool> within() const;
};
[[nodiscard]] KeyMetric headline(const MetricInfo& info, const ModelMetrics& metrics);
/// Headlines without intervals, always the same ones in the same order; those of reported fixes, if any, are
/// last.
[[nodiscard]] std::vector<KeyMetric> key_metrics(const ModelMetrics& metrics);
/// key_metrics() of metrics() of these epochs, only the key metrics.
[[nodiscard]] std::vector<KeyMetric> key_metrics(const Comparison& comparison, std::size_t first,
                                                 std::size_t count);
/// Uses the recording's own epochs [other_first, other_first + other_count) in place of the simulated ones:
/// how well one part of a recording predicts another, as a bound for models fitted to it. Without
/// explanations of single errors.
[[nodiscard]] std::vector<KeyMetric> headlines_by_other_part(const Comparison& comparison, std::size_t first,
                                                             std::size_t count, std::size_t other_first,
                                                             std::size_t other_count);
/// Their intervals: the metrics recomputed from blocks of epochs resampled with replacement. None for
/// reported fixes. @param headlines_of_all of these epochs and runs, as for metrics()
void add_intervals(std::vector<KeyMetric>& headlines_of_all, const Comparison& comparison, std::size_t first,
                   std::size_t count, const MetricOptions& options, std::span<const Comparison> runs = {});
/// The key metric with that key; null if there is none.
[[nodiscard]] const KeyMetric* headline_with(const std::vector<KeyMetric>& key_metrics, std::string_view key);
/// "2.3 (8.5)": simulated, with measured in brackets; "-" for missing values. Interval: "1.9 to 3.1 (6.0 to
/// 9.2)".
[[nodiscard]] std::string value_text(const KeyMetric& headline);
[[nodiscard]] std::string interval_text(const KeyMetric& headline);

}  // namespace canyon::validation
