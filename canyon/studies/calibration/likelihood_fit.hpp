#pragma once

#include <set>
#include <span>

#include "canyon/sky/gnss/satellite_id.hpp"
#include "canyon/studies/calibration/calibrate.hpp"

namespace canyon::calibration {

// The fit to which satellites are tracked, to their C/N0 and to errors of hidden ones. Private to
// canyon/calibration.
/// A drive, and the satellites that are left out of what is simulated.
struct FitDrive {
  const Drive* drive = nullptr;
  std::set<gnss::SatelliteId> leave_out;
};

/// Adds level and share of obstacles, and finds the share of coated glass where the drives have cities with
/// several. The receiver is simulated along the drives at the nodes of a grid of them, by several seeds each.
/// Shares of tracked satellites and densities of their C/N0, by what the map says and by elevation, are
/// linear between nodes. The values are the means of the density
///
///   exp(log-likelihood of what was recorded - 1/2 sum over keys of ((x - profile's) / prior's deviation)^2)
///
/// (docs/methods.md). @param result its values are set already for what is simulated
void add_likelihood_fit(std::span<const FitDrive> drives, const CalibrateOptions& options,
                        Calibration& result);

}  // namespace canyon::calibration
