#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "canyon/calibration/estimate.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/validation/comparison.hpp"

// A receiver's options, from what such a receiver recorded at known places. docs/calibration.md has the
// method.

namespace canyon::calibration {

/// A drive's city with facades drawn anew.
struct Facades {
  double coated_glass = 0;  ///< share of buildings that have it
  /// Makes it when it is needed, so that one city is held at a time.
  std::function<std::unique_ptr<simulation::Environment>()> make;
};

/// A recording that calibrates.
struct Drive {
  std::string name;
  const simulation::Environment* environment = nullptr;  ///< must outlive the call
  validation::Recording recording;  ///< of the part that may be learnt from, alone: part_of()
  validation::Registration registration;
  simulation::ReceiverConfig receiver;  ///< the profile, with what the scenario overrides
  std::set<gnss::System> systems;       ///< that the scenario's sky was asked for
  std::uint64_t seed = 1;
  std::vector<Facades> facades;  ///< by share, ascending; empty: those of `environment` are known
};

/// Epochs [first, first + count) of a recording alone, own fixes of that time included: nothing of the rest
/// can be learnt from it.
[[nodiscard]] validation::Recording part_of(const validation::Recording& recording, std::size_t first,
                                            std::size_t count);

struct CalibrateOptions {
  int seeds = 3;    ///< that each receiver is simulated by, from the drive's own on; at least 1
  int threads = 0;  ///< 0: as many as cores
  /// Called on the calling thread with the task, steps done and steps in all. Its exceptions end the work.
  std::function<void(const std::string&, std::size_t, std::size_t)> progress;
};

struct Calibration {
  std::vector<Estimate> estimates;
  std::vector<std::string> notes;  ///< what the profile cannot have, one line each
  Values values;                   ///< keys of the profile that are set
  /// Share of buildings with coated glass: of the city, not of the profile. Empty where the scenarios state
  /// their facades.
  std::optional<Estimate> coated_glass;
};
/// Estimates what shows in the recording itself, then the keys that the figures of the score card show
/// (docs/calibration.md). One set of values for all drives. Throws InputError where there are no drives, or
/// the profile has no strength of signals.
[[nodiscard]] Calibration calibrate(const std::vector<Drive>& drives, const CalibrateOptions& options = {});

// Facades that a scenario leaves open, for a calibration.

/// A scenario with the share of buildings with coated glass, [0, 0.7].
[[nodiscard]] simulation::Scenario with_coated_glass(simulation::Scenario scenario, double share);

/// Drive::facades: the cities that `draw` makes of the scenario with none, some and the most coated glass;
/// empty where the scenario states its facades. `draw` is called while calibrate() runs.
[[nodiscard]] std::vector<Facades> open_facades(
    const simulation::Scenario& scenario,
    const std::function<std::unique_ptr<simulation::Environment>(const simulation::Scenario&)>& draw);

/// The share of buildings with coated glass that was fitted; empty where it was not.
[[nodiscard]] std::optional<double> fitted_glass(const Calibration& result);
/// Items of a scenario's `city.facades.shares` with that share of coated glass, in percent:
/// "coated_glass=14".
[[nodiscard]] std::vector<std::string> facade_shares(double coated_glass);

}  // namespace canyon::calibration
