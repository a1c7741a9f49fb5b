#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "canyon/base/statistics.hpp"

// Statistics of recorded against modelled values. All values must be finite (asserted); a figure whose sample
// is too small is an empty optional.

namespace canyon::validation {

/// Ranks from 1; equal values share the mean of theirs.
[[nodiscard]] std::vector<double> midranks(std::span<const double> values);

struct Correlation {
  double rho = 0;  ///< Spearman's, [-1, 1]
  /// Confidence interval on Fisher's z with variance (1 + rho^2 / 2) / (n - 3) (Bonett and Wright,
  /// Psychometrika 65, 2000), of independent pairs; [-1, 1] below n = 4.
  double low = -1, high = 1;
  std::size_t n = 0;
};
/// Spearman's rank correlation with ties: Pearson's of the midranks. Empty for fewer than three pairs, or
/// where one side is constant. @param x @param y of one length (asserted) @param confidence in (0, 1)
[[nodiscard]] std::optional<Correlation> spearman(std::span<const double> x, std::span<const double> y,
                                                  double confidence = 0.95);

struct Separation {
  /// Probability that a positive scores above a negative, equals counted half: the area under the ROC curve,
  /// the Mann-Whitney statistic over n1 n2.
  double auc = 0.5;
  /// Largest (sensitivity + specificity) / 2 of "positive where score >= threshold"; 0.5 at least.
  double balanced_accuracy = 0.5;
  /// Reaches it, in the middle between two neighbouring scores; the lowest of several. -inf: all are
  /// positive.
  double threshold = -std::numeric_limits<double>::infinity();
};
/// The separation by a score of positives (expected to score high) from negatives. Empty where a side has
/// none.
[[nodiscard]] std::optional<Separation> separation(std::span<const double> positives,
                                                   std::span<const double> negatives);

/// Largest difference between the empirical distributions of two samples. Empty where a sample has none.
[[nodiscard]] std::optional<double> kolmogorov_smirnov(std::span<const double> a, std::span<const double> b);

struct Interval {
  double low = 0, high = 0;
};

}  // namespace canyon::validation
