#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/run/scenario/scenario.hpp"

namespace canyon::simulation {

/// A kind of receiver as a YAML file: `description` and the keys of `receivers[]` (docs/scenario.md) without
/// name and profile. Canyon's own stand in profiles/ and are part of the library; users bring theirs by path.
struct Profile {
  std::string description;  ///< one line
  /// Defaults with the profile's keys over them; named "receiver".
  ReceiverConfig receiver;
};

/// Visits its fields.
void visit(options::Visitor& v, Profile& profile);

/// The built-in profile of receivers without a named one: a common module with
/// its navigation filter. A ReceiverConfig{} of C++ is not it: that tracks whatever arrives.
inline constexpr std::string_view kDefaultProfile = "ublox-m10";

/// One of the profiles that come with the library.
struct BuiltInProfile {
  std::string_view name;  ///< "ublox-m8t"
  std::string_view text;  ///< its file, sources of the values in its comments
};
/// All of them, by name.
[[nodiscard]] const std::vector<BuiltInProfile>& built_in_profiles();
/// By its name; InputError with the closest one for another.
[[nodiscard]] const BuiltInProfile& built_in_profile(std::string_view name);
/// Whether `text` can only mean a file: it has a folder, or ends in .yaml or .yml.
[[nodiscard]] bool is_profile_path(std::string_view text);

/// Reads a profile. `name` stands in messages. Throws InputError with file and line as parse_scenario() does,
/// and where the description is missing.
[[nodiscard]] Profile parse_profile(const std::string& text, const std::filesystem::path& name);
[[nodiscard]] Profile read_profile(const std::filesystem::path& path);

/// read_scenario() with another profile of the first receiver: what stands below the receiver still overrides
/// it. @param profile one of built_in_profiles(), or a file (is_profile_path()), from the scenario's folder
[[nodiscard]] Scenario read_scenario_with_profile(const std::filesystem::path& path,
                                                  const std::string& profile);

/// The keys that parse_profile() knows beside `description`, with dots: "noise.sigma_m_per_sqrt_s".
[[nodiscard]] const std::vector<ScenarioKey>& profile_keys();

}  // namespace canyon::simulation
