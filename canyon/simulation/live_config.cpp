#include <fmt/format.h>

#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/options/dotted.hpp"
#include "canyon/simulation/live_receiver.hpp"
#include "canyon/simulation/scenario_fields.hpp"

namespace canyon::simulation {
namespace {

/// What of a configuration may change while its receiver runs.
struct RunningConfig {
  LiveConfig& live;
};

void visit(options::Visitor& v, RunningConfig& config) {
  ReceiverConfig& receiver = config.live.receiver;
  visit_rate(v, config.live.rate_hz);
  visit_seed(v, config.live.seed);
  if (v.describes()) visit_profile(v, receiver);
  if (v.has("profile")) {
    ReceiverConfig other;
    visit_profile(v, other);
    other.options.name = receiver.options.name;
    other.options.own_draws = receiver.options.own_draws;
    other.streets = receiver.streets;
    other.lever_arm_m = receiver.lever_arm_m;
    other.disturbances = receiver.disturbances;
    other.models = receiver.models;
    receiver = std::move(other);
  }
  visit(v, receiver);
  v.part("streets", receiver.streets);
  v.judge(receiver.options);
}

}  // namespace

void visit(options::Visitor& v, LiveConfig& config) {
  if (v.reads() && !v.has("sky")) config.sky.nominal = true;
  v.part("sky", config.sky);
  visit_start(v, config.start);
  visit_rate(v, config.rate_hz);
  visit_seed(v, config.seed);
  visit_name_and_profile(v, config.receiver, false);
  // A host's receivers may be on several vehicles, whose errors are not alike.
  if (v.reads() || v.describes()) config.receiver.options.own_draws = true;
  visit(v, config.receiver);
  v.part("streets", config.receiver.streets);
  v.judge(config.receiver.options);
}

const options::Description& live_description() {
  static const options::Description description = options::describe<LiveConfig>();
  return description;
}

namespace {

/// With what hosts whose settings have no lists of mappings cannot say.
struct LiveConfigWithFaults {
  LiveConfig live;
};

void visit(options::Visitor& v, LiveConfigWithFaults& config) {
  visit(v, config.live);
  const std::vector<std::string> name{config.live.receiver.options.name};
  disturbance::visit_faults(v, config.live.faults, name);
}

}  // namespace

LiveConfig parse_live_config(const std::string& text, const std::filesystem::path& name) {
  static const options::Description description = options::describe<LiveConfigWithFaults>();
  LiveConfigWithFaults config;
  parse(text, name, description, "scenario", "it needs at least city, sky and trajectory", config);
  return std::move(config.live);
}

const options::Description& running_description() {
  static const options::Description description = [] {
    options::Describer describer;
    LiveConfig defaults;
    RunningConfig running{defaults};
    visit(describer, running);
    return std::move(describer).take();
  }();
  return description;
}

std::string running_options(const LiveConfig& config) {
  options::DottedWriter writer;
  RunningConfig running{const_cast<LiveConfig&>(config)};  // it does not change anything
  visit(writer, running);
  return std::move(writer).take();
}

LiveConfig changed_live_config(const LiveConfig& config, const std::string& text,
                               const std::filesystem::path& name) {
  options::Document document;
  document.file = name;
  document.kind = "change";
  document.known = running_description().paths();
  const options::Node root =
      options::without_dots(options::parse_yaml(text, document, "write KEY: VALUE"), document);
  for (const char* fixed : {"name", "sky", "start"}) {
    const options::Node::Entry* entry = root.find(fixed);
    if (entry == nullptr) continue;
    throw InputError(name, entry->line, fmt::format("{}: stays as it was when the receiver began", fixed),
                     "write it where the receiver stands, and begin again");
  }
  LiveConfig changed = config;
  RunningConfig running{changed};
  options::read(root, document, running);
  return changed;
}

}  // namespace canyon::simulation
