#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

// Levels of direct signals as two states, clear and shadowed, along the way: a hidden Markov chain fitted by
// expectation and maximisation (Baum, Petrie, Soules & Weiss 1970). Private to canyon/calibration.

namespace canyon::calibration {

/// The level of one direct signal at one epoch against the link budget [dB], or that it was not tracked.
struct LevelItem {
  double level_db = 0;  ///< untracked: below this
  bool tracked = true;
  double way_m = 0;         ///< since the item before of the same chain; >= 0
  std::uint32_t epoch = 0;  ///< for weights
};
/// Items of one satellite's signal that follow each other without a break.
struct LevelChain {
  std::size_t satellite = 0;  ///< whose constant it has
  std::vector<LevelItem> items;
};

/// clear: N(constant of the satellite, clear_sigma^2); shadowed: N(that - depth, shadowed_sigma^2). The chain
/// of states has the stationary share `shadowed_share` and forgets by exp(-way / length).
///
/// What lies in shadow all the time looks as one that is weak: constants have a prior, N(level of their
/// group, kSatellites_db^2), and groups one about the profile, N(0, kGroups_db^2). Beside it a satellite
/// counts by the shadows that it could have left, one for each chain and length of way, not by epochs, which
/// repeat each other.
struct ShadowFit {
  std::vector<std::size_t> group;                ///< of each satellite: its recording, for a first signal
  std::vector<double> satellite_db;              ///< NaN: without a clear level
  std::vector<double> own_db, own_variance_db2;  ///< without the priors, under the same states
  double clear_sigma_db = 1.5, shadowed_sigma_db = 4, depth_db = 8;
  double shadowed_share = 0.2, length_m = 20;
};

/// Ends of the profiles' ranges: satellites up to 2 dB apart, budgets within 6 dB.
inline constexpr double kSatellites_db = 2, kGroups_db = 3;

/// Fits `start` to the chains by `iterations` rounds. @param weights by epoch, how often each counts; as long
/// as the items' epochs ask for
[[nodiscard]] ShadowFit fit_shadows(std::span<const LevelChain> chains,
                                    std::span<const std::uint16_t> weights, ShadowFit start, int iterations);
/// A start: constants at the 90 % quantile of what was tracked. @param group of each satellite
[[nodiscard]] ShadowFit shadow_start(std::span<const LevelChain> chains, std::vector<std::size_t> group);

}  // namespace canyon::calibration
