#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "canyon/analysis/validation/comparison.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

// A receiver's options, estimated from its recordings at known positions. docs/methods.md has the method.

namespace canyon::calibration {

/// The result for one key of a profile.
struct Estimate {
  enum class Verdict {
    Unidentified,  ///< the recordings have no or too little information on it: not changed
    Agrees,        ///< the recordings agree with the profile within their uncertainty: not changed
    Fitted         ///< the recordings differ: replaced
  };
  std::string key;            ///< with dots: "signal.lock.reacquisition_s"
  std::string unit = {};      ///< may be empty
  std::string before = {};    ///< the profile's value, as YAML
  std::string recorded = {};  ///< the value from the recordings, written or not: "14.2"
  std::string interval = {};  ///< 95 %: "13.1 to 15.3"; may be empty
  Verdict verdict = Verdict::Unidentified;
  std::string basis = {};  ///< one line: data of the estimate, or the reason why there is none

  /// The value in the calibrated profile.
  [[nodiscard]] const std::string& after() const { return verdict == Verdict::Fitted ? recorded : before; }
};
/// "fitted", "agrees", "not identified".
[[nodiscard]] std::string to_string(Estimate::Verdict verdict);

/// Keys of a profile and their values as YAML.
using Values = std::map<std::string, std::string>;
/// Sets keys of a receiver. InputError as from the reader of profiles; `what` names the text in messages.
void set_values(const Values& values, simulation::ReceiverConfig& receiver,
                const std::string& what = "calibrated values");
/// All keys of a receiver and their values.
[[nodiscard]] Values values_of(const simulation::ReceiverConfig& receiver);

/// A table of estimates for terminals.
[[nodiscard]] std::string to_text(const std::vector<Estimate>& estimates);
/// An array of objects.
[[nodiscard]] std::string to_json(const std::vector<Estimate>& estimates);

/// A number rounded to two digits of its standard deviation.
[[nodiscard]] std::string rounded(double value, double sigma);

/// The parts of a calibrated profile other than its keys.
struct ProfileHead {
  std::string description;         ///< one line
  std::string base;                ///< name of the profile from which it was made
  std::vector<std::string> notes;  ///< lines of comment at the top
};
/// Estimated key of obstacles: the scenario's `shadowing.skyline.obstacle_fraction`, not in profiles.
inline constexpr char kSkylineFraction[] = "signal.shadowing.skyline.obstacle_fraction";
/// A profile: the keys of `receiver` that differ from Canyon's defaults or have an estimate, with their
/// sources, and unidentified keys as comments. simulation::parse_profile() reads the same receiver back,
/// except for its obstacles.
[[nodiscard]] std::string profile_text(const simulation::ReceiverConfig& receiver,
                                       const std::vector<Estimate>& estimates, const ProfileHead& head);

/// A drive's city with resampled facades.
struct Facades {
  double coated_glass = 0;  ///< fraction of buildings that have it
  /// Called when the city is needed, so that only one is in memory at a time.
  std::function<std::unique_ptr<simulation::Environment>()> make;
};

/// A recording used for calibration.
struct Drive {
  std::string name;
  const simulation::Environment* environment = nullptr;  ///< must outlive the call
  validation::Recording recording;                       ///< only the part used for learning: part_of()
  validation::Registration registration;
  simulation::ReceiverConfig receiver;  ///< the profile, with the scenario's overrides
  std::set<gnss::System> systems;       ///< systems of the scenario's sky
  std::uint64_t seed = 1;
  std::vector<Facades> facades;  ///< by fraction, ascending; empty: those of `environment` are known
};

/// Only the epochs [first, first + count) of a recording, with the reported fixes of that time.
[[nodiscard]] validation::Recording part_of(const validation::Recording& recording, std::size_t first,
                                            std::size_t count);

struct CalibrateOptions {
  int seeds = 3;  ///< simulations of each receiver, with successive seeds from the drive's own on; at least 1
  int threads = 0;  ///< 0: as many as cores
  /// Called on the calling thread with the task, steps done and steps in all. Its exceptions end the work.
  std::function<void(const std::string&, std::size_t, std::size_t)> progress;
};

struct Calibration {
  std::vector<Estimate> estimates;
  std::vector<std::string> notes;  ///< estimates that a profile cannot contain, one line each
  Values values;                   ///< keys of the profile that are set
  /// Fraction of buildings with coated glass, of the city, not the profile. Empty if scenarios set facades.
  std::optional<Estimate> coated_glass;

  /// Adds an estimate of a profile's key; sets the key if it is Fitted.
  void add(Estimate estimate);
};
/// First estimates parameters from the recording alone, then the keys that affect the metrics of the score
/// card (docs/methods.md). One set of values for all drives. Throws InputError if there are no drives, or if
/// the profile's signals have no strength.
[[nodiscard]] Calibration calibrate(const std::vector<Drive>& drives, const CalibrateOptions& options = {});

// Facades that a scenario does not set, for a calibration.

/// A scenario with this fraction of buildings with coated glass, [0, 0.7].
[[nodiscard]] simulation::Scenario with_coated_glass(simulation::Scenario scenario, double fraction);

/// Drive::facades: the cities that `draw` makes of the scenario with no, some and the most coated glass;
/// empty if the scenario sets its facades. `draw` is called during calibrate().
[[nodiscard]] std::vector<Facades> open_facades(
    const simulation::Scenario& scenario,
    const std::function<std::unique_ptr<simulation::Environment>(const simulation::Scenario&)>& draw);

/// The fitted fraction of buildings with coated glass; empty if it was not fitted.
[[nodiscard]] std::optional<double> fitted_glass(const Calibration& result);
/// Items of a scenario's `city.facades.fractions` with that fraction of coated glass, in percent:
/// "coated_glass=14".
[[nodiscard]] std::vector<std::string> facade_fractions(double coated_glass);

}  // namespace canyon::calibration
