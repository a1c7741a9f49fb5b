#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "canyon/run/environment.hpp"
#include "canyon/run/scenario/scenario.hpp"
#include "canyon/studies/validation/comparison.hpp"

// A receiver's options, from what such a receiver recorded at known places. docs/methods.md has the
// method.

namespace canyon::calibration {

/// The result for one key of a profile.
struct Estimate {
  enum class Verdict {
    Unidentified,  ///< the recordings say nothing about it, or too little: kept
    Agrees,        ///< they say what the profile says, within their uncertainty: kept
    Fitted         ///< they say something else: written
  };
  std::string key;            ///< with dots: "signal.lock.reacquisition_s"
  std::string unit = {};      ///< may be empty
  std::string before = {};    ///< the profile's value, as YAML
  std::string recorded = {};  ///< what the recordings say, written or not: "14.2"
  std::string interval = {};  ///< 95 %: "13.1 to 15.3"; may be empty
  Verdict verdict = Verdict::Unidentified;
  std::string basis = {};  ///< one line: what it was estimated from, or why it was not

  /// The value that the calibrated profile has.
  [[nodiscard]] const std::string& after() const { return verdict == Verdict::Fitted ? recorded : before; }
};
/// "fitted", "agrees", "not identified".
[[nodiscard]] std::string to_string(Estimate::Verdict verdict);

/// Keys of a profile and their values as YAML.
using Values = std::map<std::string, std::string>;
/// Sets keys of a receiver. Throws InputError as the reader of profiles does; `what` names the text.
void set_values(const Values& values, simulation::ReceiverConfig& receiver,
                const std::string& what = "calibrated values");
/// All keys of a receiver and their values.
[[nodiscard]] Values values_of(const simulation::ReceiverConfig& receiver);

/// A table of estimates for terminals.
[[nodiscard]] std::string to_text(const std::vector<Estimate>& estimates);
/// An array of objects.
[[nodiscard]] std::string to_json(const std::vector<Estimate>& estimates);

/// A number with as many decimals as its standard deviation deserves: two digits of that.
[[nodiscard]] std::string rounded(double value, double sigma);

/// The parts of a calibrated profile other than its keys.
struct ProfileHead {
  std::string description;         ///< one line
  std::string base;                ///< name of the profile that it was made from
  std::vector<std::string> notes;  ///< lines of comment at the top
};
/// The key that is estimated of the obstacles: the scenario's `shadowing.skyline.share`, which no profile
/// has.
inline constexpr char kSkylineShare[] = "signal.shadowing.skyline.share";
/// A profile: the keys of `receiver` that differ from Canyon's defaults or have an estimate, with where each
/// came from, and what could not be identified as comments. simulation::parse_profile() reads the same
/// receiver back, but for its obstacles.
[[nodiscard]] std::string profile_text(const simulation::ReceiverConfig& receiver,
                                       const std::vector<Estimate>& estimates, const ProfileHead& head);

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

  /// Adds an estimate of a profile's key, and sets the key where it is Fitted.
  void add(Estimate estimate);
};
/// Estimates what shows in the recording itself, then the keys that the figures of the score card show
/// (docs/methods.md). One set of values for all drives. Throws InputError where there are no drives, or
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
