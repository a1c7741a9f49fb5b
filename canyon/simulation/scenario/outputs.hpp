#pragma once

#include <functional>
#include <set>
#include <span>
#include <string>
#include <string_view>

namespace canyon::simulation {

/// Something that a run writes (canyon/simulation/scenario/outputs.def).
struct Output {
  std::string_view name;  ///< "nmea"
  bool wanted;            ///< whether a scenario writes it by default
  std::string_view help;  ///< one line
};
/// All that `outputs:` of a scenario may name.
[[nodiscard]] std::span<const Output> outputs();

/// The outputs of a run.
struct OutputConfig {
  std::set<std::string, std::less<>> names;  ///< names of outputs()

  OutputConfig();  ///< those that scenarios write by default
  [[nodiscard]] bool has(std::string_view name) const { return names.find(name) != names.end(); }
  /// Throws InputError for a name that is not of outputs(), with the closest known one.
  void validate() const;
};

}  // namespace canyon::simulation
