#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <span>
#include <string>
#include <string_view>

#include "canyon/base/options/fwd.hpp"

namespace canyon::simulation {

/// Something that a run writes (canyon/simulation/scenario/outputs.def).
struct Output {
  std::string_view name;  ///< "nmea"
  bool wanted;            ///< whether a scenario writes it by default
  std::string_view help;  ///< one line
};
/// All outputs that `outputs:` of a scenario may name.
[[nodiscard]] std::span<const Output> outputs();

/// u-blox receivers that the output `ubx` emulates: firmware SPG 3.01 of the M8 (protocol 18.00),
/// HPG 1.32 of the F9 (27.31), SPG 5.30 of the M10 (34.30), HPG 2.10 of the X20 (50.11).
enum class UbxGeneration : std::uint8_t { M8, F9, M10, X20 };
/// Its name in a scenario and in the options of a stream: "generation".
void visit_generation(options::Visitor& v, UbxGeneration& generation);

/// A name from earlier versions, and its replacement.
struct FormerOutput {
  std::string_view name, hint;
};
[[nodiscard]] std::span<const FormerOutput> former_outputs();

struct OutputConfig {
  std::set<std::string, std::less<>> names;  ///< names of outputs()
  UbxGeneration ubx_generation = UbxGeneration::F9;

  OutputConfig();  ///< those that scenarios write by default
  [[nodiscard]] bool has(std::string_view name) const { return names.find(name) != names.end(); }
  /// Throws InputError for a name that is not of outputs(), with the closest known one.
  void validate() const;
};

}  // namespace canyon::simulation
