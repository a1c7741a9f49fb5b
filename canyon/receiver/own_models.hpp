#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "canyon/positioning/fix.hpp"

namespace canyon::receiver {

/// A program's models in the place of a receiver's own. Empty functions: the receiver's own. Called once an
/// epoch or more, in order of time, in the thread that calls Receiver::observe().
struct OwnModels {
  /// Instead of FixOptions::weights, for fix and position filter: standard deviation that a pseudorange is
  /// weighted by [m], > 0 (else InputError). @param elevation_rad true one of the satellite
  std::function<double(const positioning::Measurement& measurement, double elevation_rad)> sigma_m;
  /// Instead of positioning::solve_fix() and the position filter behind it; the arguments are those of
  /// solve_fix(), and so is what the fix must hold: where it is solved, position_ecef and position, and
  /// `used`, ascending, with its residuals.
  std::function<positioning::Fix(geodesy::GpsTime receiver_time,
                                 const std::vector<positioning::Measurement>& measurements,
                                 const orbit::Sky& sky, const positioning::FixOptions& options,
                                 const std::map<gnss::System, gnss::Klobuchar>& klobuchar)>
      solve;
};

/// Makes the models of one receiver as they are before the first epoch; a run or a world that begins anew
/// makes them anew. @param seed of the run; @param receiver what sets its draws apart, as for
/// disturbance::Source
using ModelSource = std::function<OwnModels(std::uint64_t seed, const std::string& receiver)>;

}  // namespace canyon::receiver
