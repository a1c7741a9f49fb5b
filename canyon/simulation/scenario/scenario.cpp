#include "canyon/simulation/scenario/scenario.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "canyon/base/input_error.hpp"
#include "canyon/base/named.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/node.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/receiver/rtk/correction_link.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/scenario/scenario_fields.hpp"

namespace canyon::simulation {

namespace {

constexpr std::string_view kMotions[]{"auto", "standing", "driving", "flying"};

}  // namespace

void visit(options::Visitor& v, MapOptions& o) {
  v.choice(
      {"motion", "",
       "receiver of a heat map: standing, driving (along the longest line through a cell), flying (in all "
       "directions); auto: one with a position filter and without a fixed position drives below 5 m above "
       "the terrain and flies above, others are stationary"},
      o.motion, kMotions);
  v.number({"speed_mps", "m/s", "speed of a receiver of a heat map that drives or flies"}, o.pace_mps,
           {0.1, 300});
  v.former_name("pace_mps", "speed_mps");
}

std::string_view name(Motion motion) {
  return kMotions[static_cast<std::size_t>(motion)];
}

std::string describe(const MapOptions& options) {
  const std::string_view motion = name(options.motion);
  return options.moves() ? fmt::format("{} at {:g} m/s", motion, options.pace_mps) : std::string(motion);
}

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
    } catch (const InputError&) {  // the reader reports values that are not a list or a section
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

std::optional<std::size_t> index_of_base(const std::vector<ReceiverConfig>& receivers,
                                         const ReceiverConfig& receiver) {
  const std::string& name = receiver.options.corrections.from;
  const auto at = std::find_if(receivers.begin(), receivers.end(),
                               [&name](const ReceiverConfig& each) { return each.options.name == name; });
  if (name.empty() || at == receivers.end()) return std::nullopt;
  return static_cast<std::size_t>(at - receivers.begin());
}

std::optional<ReceiverConfig> base_of(const std::vector<ReceiverConfig>& receivers,
                                      const ReceiverConfig& receiver) {
  const std::optional<std::size_t> base = index_of_base(receivers, receiver);
  return base ? std::optional(receivers[*base]) : std::nullopt;
}

void check_corrections(const std::vector<ReceiverConfig>& receivers, std::size_t index) {
  const receiver::ReceiverOptions& options = receivers[index].options;
  const std::string& from = options.corrections.from;
  if (options.rtk.enabled && !options.signal.enabled) {
    throw InputError(
        fmt::format("receiver '{}': rtk needs carrier phases, which need signal strengths", options.name),
        "give signal: {enabled: true}, or a profile that has it");
  }
  if (from.empty() || rtk::is_stream(from)) return;
  const auto refuse = [&](std::string_view problem, std::string_view hint) {
    throw InputError(fmt::format("receiver '{}' uses corrections from '{}', {}", options.name, from, problem),
                     hint);
  };
  const std::optional<std::size_t> base = index_of_base(receivers, receivers[index]);
  if (!base) {
    refuse("which is not a receiver of the scenario",
           fmt::format("receivers: {}", fmt::join(receiver_names(receivers), ", ")));
  }
  if (*base == index) refuse("itself", "name a receiver with a fixed position");
  std::optional<std::size_t> next = base;
  for (std::size_t steps = 0; next && steps < receivers.size(); ++steps) {
    next = index_of_base(receivers, receivers[*next]);
    if (next == index) refuse("which itself depends on this receiver", "remove one of them");
  }
  if (options.corrections.virtual_station && !receivers[*base].fixed) {
    refuse("which moves: a virtual station needs a fixed base",
           "leave virtual_station out, or give that receiver a fixed position");
  }
  if (!receivers[*base].fixed && !options.rtk.enabled) {
    refuse("whose position is not known",
           "give that receiver fixed: {latitude_deg: ..., longitude_deg: ...}, or this one rtk: true for the "
           "heading of two antennas");
  }
  if (!options.independent_noise && !receivers[*base].options.independent_noise) {
    refuse("and both have the same noise, which would vanish in the difference",
           "remove independent_noise: false from one of them");
  }
}

}  // namespace canyon::simulation
