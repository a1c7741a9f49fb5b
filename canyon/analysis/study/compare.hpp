#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "canyon/analysis/study/run_store.hpp"

namespace canyon::study {

/// A mean with its interval.
struct MeanEstimate {
  double mean = 0, low = 0, high = 0;
};
/// A metric whose means are compared.
struct Compared {
  std::string name, unit;
  double scale;                      ///< from of() to the unit
  std::optional<std::size_t> index;  ///< in metrics(); empty: the fraction of available epochs

  /// Empty if the record has no value.
  [[nodiscard]] std::optional<double> of(const ReceiverRecord& record) const;
};
[[nodiscard]] const std::vector<Compared>& compared_metrics();

/// The runs of one setting: one value on each grouping axis, one receiver.
struct Group {
  std::vector<std::string> at;  ///< labels on the grouping axes
  std::string receiver;
  std::size_t runs = 0;
  /// By compared_metrics(): over the group's runs; and minus the first group, over the noise realizations of
  /// both.
  std::vector<std::optional<MeanEstimate>> estimates, differences;
  std::vector<const ReceiverRecord*> records;  ///< by noise realization, null if it has none
};

struct GroupComparison {
  std::vector<std::string> axes;  ///< grouping axes
  std::vector<Group> groups;
};

/// Means of runs' metrics for every group, with percentile bootstrap intervals (Efron and Tibshirani, An
/// Introduction to the Bootstrap, 1993, chapter 13) over noise realizations: these are resampled with
/// replacement, the same ones for all groups, so that differences are of pairs. Failed runs and missing
/// metrics are left out of means.
[[nodiscard]] GroupComparison compare(const Manifest& manifest,
                                      const std::vector<std::optional<RunRecord>>& records);
/// Long form: a line for each group and metric.
[[nodiscard]] std::string comparison_csv(const GroupComparison& comparison);
/// A table for terminals of the most important metrics.
[[nodiscard]] std::string comparison_text(const Manifest& manifest, const GroupComparison& comparison);

/// Noise realizations, resampled with replacement: indices into Group::records.
using Resamples = std::vector<std::vector<std::uint32_t>>;
/// Manifest::bootstrap resamples, fewer for many occasions, none for one; the same for equal manifests.
[[nodiscard]] Resamples occasion_resamples(const Manifest& manifest, std::size_t occasions);

/// A field of a CSV line, in quotes if necessary.
[[nodiscard]] std::string csv_text(const std::string& text);
/// Mean, low and high as three fields of a CSV line; a field without a value is empty.
[[nodiscard]] std::string csv_interval(const std::optional<MeanEstimate>& estimate);

}  // namespace canyon::study
