#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

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

}  // namespace canyon::validation
