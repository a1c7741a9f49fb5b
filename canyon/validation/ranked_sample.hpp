#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/validation/statistics.hpp"

// Not public: of canyon/validation and canyon/calibration.

namespace canyon::validation {

/// Scores of LOS and NLOS observations, sorted once, whose area under the ROC curve is wanted for many
/// resamples of their epochs.
class RankedSample {
 public:
  struct Item {
    double score = 0;   ///< NLOS is expected to score high; finite
    bool nlos = false;  ///< a positive
    std::uint32_t epoch = 0;
  };
  explicit RankedSample(std::vector<Item> items);

  /// separation().auc of the sample with each observation as often as `times[epoch]` says; empty where LOS or
  /// NLOS have none. @param times by epoch, as long as the items' epochs ask for
  [[nodiscard]] std::optional<double> auc(std::span<const std::uint16_t> times) const;

 private:
  std::vector<Item> items_;  ///< by score
};

/// Blocks of epochs, drawn with replacement in circles (Politis and Romano 1992): for each of `resamples` how
/// often each of `epochs` was drawn. @param block
/// at least 1
[[nodiscard]] std::vector<std::vector<std::uint16_t>> block_draws(std::size_t epochs, std::size_t block,
                                                                  int resamples, std::uint64_t seed);

// Not public: of canyon/validation and canyon/calibration.

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

/// block_draws() of these times or epochs in blocks of `seconds`, by their median interval: of at least one
/// epoch, and at most a fifth of all, because resamples of fewer blocks hardly differ, and look sure.
template <typename Times>
[[nodiscard]] std::vector<std::vector<std::uint16_t>> draws_in_time(const Times& times, double seconds,
                                                                    int resamples, std::uint64_t seed) {
  const double epochs = std::round(seconds / std::max(interval_of(times), 1e-3));
  const double most = std::floor(static_cast<double>(times.size()) / 5);
  const auto block = static_cast<std::size_t>(std::max(1.0, std::min(epochs, most)));
  return block_draws(times.size(), block, resamples, seed);
}

}  // namespace canyon::validation
