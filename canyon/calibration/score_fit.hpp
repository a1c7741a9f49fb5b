#pragma once

#include <set>
#include <span>

#include "canyon/calibration/calibrate.hpp"

// The keys that are fitted to the figures of the score card. Private to canyon/calibration.

namespace canyon::calibration {

/// A drive, and the satellites that are left out of what is simulated.
struct FitDrive {
  const Drive* drive = nullptr;
  std::set<gnss::SatelliteId> leave_out;
};

/// Adds level, share of obstacles and tracking threshold. The receiver is simulated along the drives at the
/// nodes of a grid of the three, by several seeds each. Figures of the score card are linear between nodes.
/// The values are the means of the density
///
///   exp(-1/2 (sum over figures of (d / s)^2 + sum over keys of ((x - profile's) / prior's deviation)^2)),
///
/// d validation::range_distance(), its squares in the mean over seeds (docs/calibration.md). @param result
/// its values are set already for what is simulated
void add_score_fit(std::span<const FitDrive> drives, const CalibrateOptions& options, Calibration& result);

}  // namespace canyon::calibration
