#pragma once

#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "canyon/calibration/calibrate.hpp"
#include "canyon/calibration/moments.hpp"

// The parameters of a receiver that show through simulation alone. Private to canyon/calibration.

namespace canyon::calibration {

/// What a drive gives to the fit.
struct FitDrive {
  const Drive* drive = nullptr;
  std::set<gnss::SatelliteId> leave_out;
  Moments recorded;
  std::vector<Moments> resampled;  ///< `recorded` of blocks drawn with replacement
};

struct SimulatedFit {
  std::vector<Estimate> estimates, environment;
  std::vector<std::string> notes;
  Values values;
  Values surroundings;                          ///< keys of a scenario's `propagation`
  std::map<std::string, double> facade_shares;  ///< empty: not identified, or not asked for
};

/// The method of simulated moments (McFadden, Econometrica 57, 1989) with priors: the sum of squares of
/// recorded less simulated moments over their deviations, and of parameters less the profile's over the
/// priors', is minimised by Levenberg and Marquardt (MINPACK's, of Eigen). Moments' deviations are those of
/// the bootstrap, for the recorded and for the simulated drive alike. Draws are common to all simulations.
/// @param values of the profile that are set already @param base values of the whole profile
/// @param step_db that C/N0 are stated in
[[nodiscard]] SimulatedFit fit_by_simulation(std::span<const FitDrive> drives, const Values& base,
                                             const Values& values, double step_db,
                                             const CalibrateOptions& options);

/// Horizontal errors of the recorded receiver's own fixes.
[[nodiscard]] FixErrors own_fixes_of(const validation::Recording& recording);

}  // namespace canyon::calibration
