#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/geodesy/constants.hpp"
#include "canyon/simulation/scenario.hpp"
#include "canyon/simulation/yaml_section.hpp"

// Sections that scenarios and hosts' configurations have in common. Private to canyon/simulation. Each reads
// its section, checks it and finishes it; InputError with file and line for what is wrong.

namespace canyon::simulation {

/// The key overrides the field where it is there.
inline void set(double& field, const std::optional<double>& value) {
  field = value.value_or(field);
}
inline void set(bool& field, const std::optional<bool>& value) {
  field = value.value_or(field);
}
inline void set(int& field, const std::optional<std::int64_t>& value) {
  if (value) field = static_cast<int>(*value);
}
inline void set_deg(double& field_rad, const std::optional<double>& value_deg) {
  if (value_deg) field_rad = geodesy::radians(*value_deg);
}

/// Which one of the alternatives is there; nothing where none is.
[[nodiscard]] std::optional<std::string> only_one(const YamlSection& section,
                                                  const std::vector<std::string>& keys);
[[nodiscard]] double required(YamlSection& section, std::string_view key, const Range& range);

/// A struct's own validate() has the last word on what ranges of single keys cannot say.
template <typename Options>
void validate(const Options& options, const YamlSection& section) {
  try {
    options.validate();
  } catch (const InputError& e) {
    throw section.section_error(e.problem(), e.cure());
  }
}

[[nodiscard]] SkyConfig read_sky(YamlSection& section);
/// The key `start` of `root`; empty where it is absent.
[[nodiscard]] std::optional<geodesy::GpsTime> read_start(YamlSection& root);
/// The key `seed` of `root`, 1 where it is absent.
[[nodiscard]] std::uint64_t read_seed(YamlSection& root);
void read_propagation(YamlSection& section, propagation::PropagationOptions& options);
void read_noise(YamlSection& section, receiver::NoiseOptions& options);

/// What the key `profile` of a section says, or the defaults where it is absent.
[[nodiscard]] ReceiverConfig read_profile_key(YamlSection& section);
/// Everything of a receiver but name and profile; does not finish the section.
void read_receiver_keys(YamlSection& section, ReceiverConfig& config);

/// Words of scenarios for values of options.
[[nodiscard]] const char* word(positioning::Weighting weighting);
[[nodiscard]] const char* word(tracking::Discriminator discriminator);
[[nodiscard]] const char* word(signal::FoliageModel model);
[[nodiscard]] const char* word(disturbance::ShadowingEnvironment environment);
/// A receiver's name names folders; throws where it cannot.
void check_name(const YamlSection& section, const std::string& name);

}  // namespace canyon::simulation
