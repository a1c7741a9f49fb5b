#pragma once

#include <map>
#include <string>
#include <vector>

#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::calibration {

/// The result for one key of a profile.
struct Estimate {
  enum class Verdict {
    Unidentified,  ///< the recordings say nothing about it, or too little: kept
    Agrees,        ///< they say what the profile says, within their uncertainty: kept
    Fitted         ///< they say something else: written
  };
  std::string key;            ///< with dots: "signal.lock.reacquisition_s"
  std::string unit;           ///< may be empty
  std::string before, after;  ///< values as YAML; alike unless Fitted
  std::string recorded;       ///< what the recordings say, where that is kept in `after` or not: "14.2"
  std::string interval;       ///< 95 %: "13.1 to 15.3"; may be empty
  Verdict verdict = Verdict::Unidentified;
  std::string basis;  ///< one line: what it was estimated from, or why it was not
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
/// A profile: the keys of `receiver` that differ from Canyon's defaults or have an estimate, with where each
/// came from, and what could not be identified as comments. simulation::parse_profile() reads the same
/// receiver back.
[[nodiscard]] std::string profile_text(const simulation::ReceiverConfig& receiver,
                                       const std::vector<Estimate>& estimates, const ProfileHead& head);

}  // namespace canyon::calibration
