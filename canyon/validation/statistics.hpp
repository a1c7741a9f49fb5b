#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "canyon/base/statistics.hpp"

// Statistics of recorded against modelled values. All values must be finite (asserted); what a sample is too
// small for is an empty optional. p-values and standard errors take values as independent: those of a drive
// are not, being seconds apart, so that confidence there comes from bootstrap_interval() with blocks.

namespace canyon::validation {

/// Ranks from 1; equal values share the mean of theirs.
[[nodiscard]] std::vector<double> midranks(std::span<const double> values);

struct Correlation {
  double rho = 0;  ///< Spearman's, [-1, 1]
  /// Two-sided, of no association: t = rho sqrt((n - 2) / (1 - rho^2)) on n - 2 degrees of freedom (Kendall
  /// and Stuart, vol. 2, 31.19), good from n = 10 on.
  double p_value = 1;
  /// Confidence interval on Fisher's z with variance (1 + rho^2 / 2) / (n - 3) (Bonett and Wright,
  /// Psychometrika 65, 2000); [-1, 1] below n = 4.
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
  /// Of the AUC: DeLong, DeLong and Clarke-Pearson, Biometrics 44, 1988; 0 with one value on a side.
  double standard_error = 0;
  /// Largest (sensitivity + specificity) / 2 of "positive where score >= threshold"; 0.5 at least.
  double balanced_accuracy = 0.5;
  /// Reaches it, in the middle between two neighbouring scores; the lowest of several. -inf: all are
  /// positive.
  double threshold = -std::numeric_limits<double>::infinity();
  std::size_t positives = 0, negatives = 0;
};
/// How well a score tells positives (expected to score high) from negatives. Empty where a side has none.
[[nodiscard]] std::optional<Separation> separation(std::span<const double> positives,
                                                   std::span<const double> negatives);

struct KolmogorovSmirnov {
  double d = 0;        ///< largest difference between the two empirical distributions
  double p_value = 1;  ///< two-sided, of one common distribution
  bool exact = false;
};
/// Two samples. The p-value is exact where n1 n2 <= 1,000,000 and no two values are equal (paths on a
/// lattice: Kim and Jennrich, Selected Tables in Mathematical Statistics 1, 1970), else Kolmogorov's limit
/// with Stephens' correction, lambda = (sqrt(ne) + 0.12 + 0.11 / sqrt(ne)) D, ne = n1 n2 / (n1 + n2) (Journal
/// of the Royal Statistical Society B 32, 1970). The limit is within 0.012 of exact values beyond 1,000,000,
/// and, for samples with equal values, within 0.04 from 100 by 100 on and 0.15 from 8 by 8 on, at its worst
/// where p is about a half (beside scipy.stats.ks_2samp). Empty where a sample has none.
[[nodiscard]] std::optional<KolmogorovSmirnov> kolmogorov_smirnov(std::span<const double> a,
                                                                  std::span<const double> b);

struct BootstrapOptions {
  int resamples = 2000;      ///< [100, 1,000,000]
  double confidence = 0.95;  ///< (0, 1)
  /// Observations drawn together, in circles (Politis and Romano 1992): as many as hang together in time. 1:
  /// independent ones. [1, number of observations], larger ones are cut to it.
  std::size_t block = 1;
  std::uint64_t seed = 1;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};

struct Interval {
  double low = 0, high = 0;
};
/// Percentile interval (Efron and Tibshirani, An Introduction to the Bootstrap, 1993, 13.3) of a statistic of
/// n observations in order. `statistic` gets n indices in [0, n), with repeats; resamples for which it is
/// empty do not count. Same seed, same interval. Empty where n is 0 or half of the resamples or more have no
/// value.
[[nodiscard]] std::optional<Interval> bootstrap_interval(
    std::size_t n, const std::function<std::optional<double>(std::span<const std::size_t>)>& statistic,
    const BootstrapOptions& options = {});

struct Histogram {
  double low = 0, width = 1;  ///< bin i is [low + i width, low + (i + 1) width)
  std::vector<std::size_t> counts;
  std::size_t below = 0, above = 0;  ///< outside; the upper end itself is above
};
/// `bins` equal bins over [low, high). Throws InputError for no bin, or unless low < high, both finite.
[[nodiscard]] Histogram histogram(std::span<const double> values, double low, double high, std::size_t bins);

// Distributions behind the p-values.

/// Probability of |T| >= |t| of Student's t, `degrees` > 0.
[[nodiscard]] double student_two_sided(double t, double degrees);
/// Kolmogorov's limit, probability of a value >= lambda: 2 sum (-1)^(k-1) exp(-2 k^2 lambda^2), within 1e-12.
[[nodiscard]] double kolmogorov_tail(double lambda);
/// Quantile of the standard normal, p in (0, 1).
[[nodiscard]] double normal_quantile(double p);

}  // namespace canyon::validation
