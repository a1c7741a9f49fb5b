#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "canyon/analysis/validation/comparison.hpp"
#include "canyon/base/options/fwd.hpp"

namespace canyon::validation {

struct AlignOptions {
  /// Offsets searched [m]: [-reach, reach] about the scenario's own, east and north, every 2 m and about the
  /// best every 0.25 m. [4, 200].
  double reach_m = 16;
  bool heading = false;  ///< estimate the city's heading as well, about the middle of the drive
  double heading_reach_rad =
      0.05235987755982988;  ///< 3 deg; headings are searched by 0.125 deg. [0.125 deg, pi/4]
  int resamples = 200;      ///< of the bootstrap for the uncertainty, [20, 10,000]
  double block_s = 30;      ///< length of resampled blocks [s]; [1, 600]; at most a fifth of the part
  std::uint64_t seed = 1;
  int threads = 0;  ///< 0: as many as cores
  /// Moves tried, and the approximate total, which grows during the search. Exceptions from it end the work
  /// and pass through.
  std::function<void(std::size_t, std::size_t)> progress;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, AlignOptions& o);

/// The city's best fit to a recording: the move that best separates the city's LOS and NLOS by C/N0 and by
/// pseudorange error together.
struct CityAlignment {
  Registration registration;
  double sigma_east_m = 0, sigma_north_m = 0, sigma_heading_rad = 0;  ///< from resampled blocks of time
  /// Mean of both AUCs, here and unmoved; without recorded C/N0 only that of the error.
  double score = 0, score_before = 0;
  std::size_t first = 0, count = 0;  ///< epochs used
  bool at_border = false;            ///< the best offset is at the edge of the search: increase reach_m
};

/// Estimated on epochs [first, first + count) of the recording, from satellites above the mask. For each
/// move, the clock is estimated again from the clear satellites. Throws InputError for options that do not
/// validate() and if no move of the city has both LOS and NLOS in these epochs.
[[nodiscard]] CityAlignment align(const Recording& recording, const simulation::Environment& environment,
                                  double elevation_mask_rad, std::size_t first, std::size_t count,
                                  const AlignOptions& options = {});

/// An object with SI units in the names (angles in degrees).
[[nodiscard]] std::string to_json(const CityAlignment& alignment);

}  // namespace canyon::validation
