#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::simulation {

/// A kind of receiver as a YAML file: `description` and the keys of `receivers[]` (docs/scenario.md) without
/// name and profile. Canyon's profiles are in profiles/ and part of the library; users give theirs by path.
struct Profile {
  std::string description;  ///< one line
  /// Defaults, overridden by the profile's keys; named "receiver".
  ReceiverConfig receiver;
};

void visit(options::Visitor& v, Profile& profile);

/// The built-in profile of receivers without a given one: a common module with its navigation filter. It
/// differs from a ReceiverConfig{} of C++, which tracks all signals that arrive.
inline constexpr std::string_view kDefaultProfile = "ublox-m10";

/// One of the profiles that come with the library.
struct BuiltInProfile {
  std::string_view name;  ///< "ublox-m8t"
  std::string_view text;  ///< its file, sources of the values in its comments
};
/// All of them, by name.
[[nodiscard]] const std::vector<BuiltInProfile>& built_in_profiles();
/// By its name; InputError with the closest name for an unknown one.
[[nodiscard]] const BuiltInProfile& built_in_profile(std::string_view name);
/// Whether `text` can only mean a file: it has a folder, or ends in .yaml or .yml.
[[nodiscard]] bool is_profile_path(std::string_view text);

/// Reads a profile. `name` appears in messages. Throws InputError with file and line as parse_scenario()
/// does, and if the description is missing.
[[nodiscard]] Profile parse_profile(const std::string& text, const std::filesystem::path& name);
[[nodiscard]] Profile read_profile(const std::filesystem::path& path);

/// read_scenario() with another profile of the first receiver, whose other keys still override the profile.
/// @param profile one of built_in_profiles(), or a file (is_profile_path()) from the scenario's folder
[[nodiscard]] Scenario read_scenario_with_profile(const std::filesystem::path& path,
                                                  const std::string& profile);

/// The keys of parse_profile() other than `description`, with dots: "noise.sigma_m_per_sqrt_s".
[[nodiscard]] const std::vector<ScenarioKey>& profile_keys();

}  // namespace canyon::simulation
