#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "canyon/calibration/estimate.hpp"
#include "canyon/orbit/sky.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/validation/comparison.hpp"

// A receiver's options, from what such a receiver recorded at known places. docs/calibration.md has the
// method.

namespace canyon::calibration {

/// A recording that calibrates.
struct Drive {
  std::string name;
  const simulation::Environment* environment = nullptr;  ///< must outlive the call
  std::shared_ptr<const orbit::Sky> sky;                 ///< the environment's
  validation::Recording recording;  ///< of the part that may be learnt from, alone: part_of()
  validation::Registration registration;
  simulation::ReceiverConfig receiver;  ///< the profile, with what the scenario overrides
  std::set<gnss::System> systems;       ///< that the scenario's sky was asked for
  std::uint64_t seed = 1;
};

/// Epochs [first, first + count) of a recording alone, own fixes of that time included: nothing of the rest
/// can be learnt from it.
[[nodiscard]] validation::Recording part_of(const validation::Recording& recording, std::size_t first,
                                            std::size_t count);

/// The drive's city with other facades under the same sky, drawn by the drive's seed.
[[nodiscard]] simulation::Environment with_facades(const Drive& drive,
                                                   const std::map<std::string, double>& shares);

struct CalibrateOptions {
  bool environment = false;  ///< estimate the surroundings as well
  int threads = 0;           ///< 0: as many as cores
  /// Blocks of time of the bootstrap [s], and how many draws.
  double block_s = 60;
  int resamples = 60;
  int iterations = 4;  ///< of the simulated fit
  /// What is done, steps done and in all; on the calling thread. What it throws ends the work and comes out.
  std::function<void(const std::string&, std::size_t, std::size_t)> progress;
};

struct Calibration {
  std::vector<Estimate> estimates;              ///< of the profile
  std::vector<Estimate> environment;            ///< of the scenario: "city.facades.shares"
  std::vector<std::string> notes;               ///< what does not fit, one line each
  Values values;                                ///< keys of the profile that are set
  Values surroundings;                          ///< keys of a scenario's `propagation` that are set
  std::map<std::string, double> facade_shares;  ///< of a scenario's `city.facades`; empty: not identified
  std::string fragment;  ///< of a scenario, as YAML; empty without CalibrateOptions::environment
  std::map<std::string, std::set<gnss::SatelliteId>>
      never_tracked;  ///< by drive, left out of what is simulated
};
/// Estimates by levels in clear view, then by the moments of simulated receivers (docs/calibration.md). One
/// set of values for all drives. Throws InputError where there are no drives, or the profile has no strength
/// of signals.
[[nodiscard]] Calibration calibrate(const std::vector<Drive>& drives, const CalibrateOptions& options = {});

}  // namespace canyon::calibration
