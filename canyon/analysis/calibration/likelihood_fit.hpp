#pragma once

#include <set>
#include <span>

#include "canyon/analysis/calibration/calibrate.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

namespace canyon::calibration {

// The fit to the tracked satellites, their C/N0 and the errors of hidden ones. Private to this folder.
/// A drive, and the satellites that are not simulated.
struct FitDrive {
  const Drive* drive = nullptr;
  std::set<gnss::SatelliteId> leave_out;
};

/// Adds level and fraction of obstacles, and finds the fraction of coated glass if the drives have several
/// cities. The receiver is simulated along the drives at the nodes of a grid of these values, with several
/// seeds each. Fractions of tracked satellites and densities of their C/N0, by visibility in the map and by
/// elevation, are linear between nodes. The values are the means of the density
///
///   exp(log-likelihood of the recording - 1/2 sum over keys of ((x - profile's) / prior's deviation)^2)
///
/// (docs/methods.md). @param result its values are already those of the simulated receiver
void add_likelihood_fit(std::span<const FitDrive> drives, const CalibrateOptions& options,
                        Calibration& result);

}  // namespace canyon::calibration
