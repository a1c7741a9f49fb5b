#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/statistics.hpp"

// Statistics of recorded against modelled values. All values must be finite (asserted); a statistic of too
// small a sample is an empty optional.

namespace canyon::validation {

/// Ranks from 1; equal values all have their mean rank.
[[nodiscard]] std::vector<double> midranks(std::span<const double> values);

struct RankCorrelation {
  double rho = 0;  ///< Spearman's, [-1, 1]
  /// Confidence interval on Fisher's z with variance (1 + rho^2 / 2) / (n - 3) (Bonett and Wright,
  /// Psychometrika 65, 2000), of independent pairs; [-1, 1] below n = 4.
  double low = -1, high = 1;
  std::size_t n = 0;
};
/// Spearman's rank correlation with ties: Pearson's of the midranks. Empty for fewer than three pairs, or if
/// one side is constant. @param x @param y of one length (asserted) @param confidence in (0, 1)
[[nodiscard]] std::optional<RankCorrelation> spearman(std::span<const double> x, std::span<const double> y,
                                                      double confidence = 0.95);

struct Separation {
  /// Probability that a positive scores above a negative, equals counted half: the area under the ROC curve,
  /// the Mann-Whitney statistic over n1 n2.
  double auc = 0.5;
  /// Largest (sensitivity + specificity) / 2 of "positive where score >= threshold"; 0.5 at least.
  double balanced_accuracy = 0.5;
  /// Threshold of balanced_accuracy, in the middle between two neighbouring scores; the lowest of several.
  /// -inf: all are positive.
  double threshold = -std::numeric_limits<double>::infinity();
};
/// How well a score separates positives (expected to score high) from negatives. Empty if there are no
/// positives or no negatives.
[[nodiscard]] std::optional<Separation> separation(std::span<const double> positives,
                                                   std::span<const double> negatives);

/// Largest difference between the empirical distributions of two samples. Empty if a sample is empty.
[[nodiscard]] std::optional<double> kolmogorov_smirnov(std::span<const double> a, std::span<const double> b);

struct Interval {
  double low = 0, high = 0;
};

// Not public: for canyon/analysis/validation and calibration.

/// Scores of LOS and NLOS observations, sorted once, to compute the area under the ROC curve for many
/// resamples of their epochs.
class RankedSample {
 public:
  struct Item {
    double score = 0;   ///< NLOS is expected to score high; finite
    bool nlos = false;  ///< a positive
    std::uint32_t epoch = 0;
  };
  explicit RankedSample(std::vector<Item> items);

  /// separation().auc of the sample with each observation repeated `times[epoch]` times; empty if no LOS or
  /// no NLOS is left. @param times by epoch, with an element for each epoch of the items
  [[nodiscard]] std::optional<double> auc(std::span<const std::uint16_t> times) const;

 private:
  std::vector<Item> items_;  ///< by score
};

/// Circular block bootstrap of epochs (Politis and Romano 1992): for each of `resamples`, how often each of
/// `epochs` was drawn. @param block at least 1
[[nodiscard]] std::vector<std::vector<std::uint16_t>> block_bootstrap(std::size_t epochs, std::size_t block,
                                                                      int resamples, std::uint64_t seed);

// Not public: for canyon/analysis/validation and calibration.

[[nodiscard]] inline geodesy::GpsTime time_of(geodesy::GpsTime time) {
  return time;
}
template <typename Epoch>
[[nodiscard]] auto time_of(const Epoch& epoch) -> decltype(epoch.time) {
  return epoch.time;
}
template <typename Epoch>
[[nodiscard]] auto time_of(const Epoch& epoch) -> decltype(epoch.reception) {
  return epoch.reception;
}

/// Median interval of times, or of epochs, in order [s]; 1 for fewer than two.
template <typename Times>
[[nodiscard]] double interval_of(const Times& times) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(time_of(times[i]) - time_of(times[i - 1]));
  return median(steps).value_or(1);
}

/// block_bootstrap() of these times or epochs in blocks of `seconds`, by their median interval: of at least
/// one epoch, and at most a fifth of all, because resamples of fewer blocks hardly differ and pretend
/// certainty.
template <typename Times>
[[nodiscard]] std::vector<std::vector<std::uint16_t>> time_block_bootstrap(const Times& times, double seconds,
                                                                           int resamples,
                                                                           std::uint64_t seed) {
  const double epochs = std::round(seconds / std::max(interval_of(times), 1e-3));
  const double maximum = std::floor(static_cast<double>(times.size()) / 5);
  const auto block = static_cast<std::size_t>(std::max(1.0, std::min(epochs, maximum)));
  return block_bootstrap(times.size(), block, resamples, seed);
}

}  // namespace canyon::validation
