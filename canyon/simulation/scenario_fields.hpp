#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "canyon/options/describe.hpp"
#include "canyon/options/node.hpp"
#include "canyon/options/read.hpp"
#include "canyon/simulation/scenario.hpp"

// Fields that scenarios, hosts' configurations and profiles share. Private to canyon/simulation.

namespace canyon::simulation {

inline constexpr options::Range kLatitude_deg{-90, 90}, kLongitude_deg{-180, 180}, kHeight_m{-10e3, 100e3};

void visit_rate(options::Visitor& v, std::optional<double>& rate_hz);
void visit_seed(options::Visitor& v, std::uint64_t& seed);
/// A mapping of names to true and false, or a list of names.
void visit_outputs(options::Visitor& v, OutputConfig& config);
/// A reader puts waypoints by east, north, up in place where the city's origin is known.
void visit_trajectory(options::Visitor& v, TrajectoryConfig& config, const CityConfig& city);
void visit_fixed(options::Visitor& v, std::optional<FixedPlace>& fixed, const CityConfig& city);
/// Name and profile, which a reader lets stand for the defaults of all other fields. `several`: a name is
/// needed.
void visit_name_and_profile(options::Visitor& v, ReceiverConfig& config, bool several);
/// A reader sets the whole config by the profile that stands there, or by the default one.
void visit_profile(options::Visitor& v, ReceiverConfig& config);

/// Reads a YAML text into `options`. Throws InputError with file and line. @param change of what was written,
/// before it is read
template <typename Options>
void parse(const std::string& text, const std::filesystem::path& name,
           const options::Description& description, const char* kind, const char* needs, Options& options,
           const std::function<void(options::Node&)>& change = {}) {
  options::Document document;
  document.file = name;
  document.kind = kind;
  document.known = description.paths();
  options::Node root = options::parse_yaml(text, document, needs);
  if (change) change(root);
  options::read(root, document, options);
}

}  // namespace canyon::simulation
