#include "canyon/simulation/scenario/scenario.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "canyon/base/named.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/options/settings_tree.hpp"
#include "canyon/options/values.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/scenario/scenario_fields.hpp"

namespace canyon::simulation {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{16} << 20;
constexpr const char* kNeeds = "it needs at least city, sky and trajectory";

}  // namespace

Scenario parse_scenario(const std::string& text, const std::filesystem::path& name,
                        const ScenarioReadOptions& options) {
  Scenario scenario;
  scenario.file = name;
  options::Document document = document_of(name);
  document.set_keys(scenario_description());
  if (options.trajectory_needed) {
    options::read_yaml(text, document, kNeeds, scenario);
  } else {
    ScenarioOfAnyTrajectory any{scenario};
    options::read_yaml(text, document, kNeeds, any);
  }
  return scenario;
}

std::size_t find_receiver(const Scenario& scenario, const std::string& name) {
  if (name.empty()) return 0;
  const std::vector<std::string> names = receiver_names(scenario.receivers);
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  throw InputError(fmt::format("the scenario has no receiver '{}'", name), known_names(name, names));
}

Scenario read_scenario(const std::filesystem::path& path, const ScenarioReadOptions& options) {
  const TextFile file(path, kMaxBytes);
  return parse_scenario(std::string(file.text()), path, options);
}

Scenario read_scenario_with_profile(const std::filesystem::path& path, const std::string& profile) {
  const TextFile file(path, kMaxBytes);
  Scenario scenario;
  scenario.file = path;
  const auto change = [&profile](options::Node& root) {
    try {
      options::set_at(root, "receivers[0].profile", options::scalar_node(profile));
    } catch (const InputError&) {  // the reader names what is not a list or a section
    }
  };
  options::read_yaml(std::string(file.text()), document_of(path), kNeeds, scenario, change);
  return scenario;
}

std::string scenario_yaml(const Scenario& scenario) {
  return options::yaml(scenario);
}

const options::Description& scenario_description() {
  return options::description_of<Scenario>();
}

const std::vector<ScenarioKey>& scenario_keys() {
  return scenario_description().keys;
}

}  // namespace canyon::simulation
