#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "canyon/validation/comparison.hpp"

namespace canyon::validation {

struct AlignOptions {
  double reach_m = 16;   ///< offsets searched: [-reach, reach] about the scenario's own, east and north
  bool heading = false;  ///< estimate the city's heading as well
  double heading_reach_rad = 0.05235987755982988;  ///< 3 deg
  int resamples = 200;                             ///< of the bootstrap behind the uncertainty
  double block_s = 30;
  std::uint64_t seed = 1;
  int threads = 0;
  std::function<void(std::size_t, std::size_t)> progress;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};

/// Where the city fits a recording best: the move under which the city's LOS and NLOS are told apart best by
/// C/N0 and by pseudorange error together.
struct Alignment {
  Registration registration;
  double sigma_east_m = 0, sigma_north_m = 0, sigma_heading_rad = 0;  ///< from blocks of time drawn anew
  double score = 0, score_before = 0;                                 ///< mean of both AUCs, here and unmoved
  std::size_t first = 0, count = 0;                                   ///< epochs used
  bool at_border = false;  ///< the best offset lies at the end of the search: give more reach
};

/// Estimated on epochs [first, first + count) of the recording.
[[nodiscard]] Alignment align(const Recording& recording, const simulation::Environment& environment,
                              double elevation_mask_rad, std::size_t first, std::size_t count,
                              const AlignOptions& options = {});

[[nodiscard]] std::string to_json(const Alignment& alignment);

}  // namespace canyon::validation
