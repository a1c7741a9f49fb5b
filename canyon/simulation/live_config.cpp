#include <fmt/format.h>

#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/options/dotted.hpp"
#include "canyon/options/folder_name.hpp"
#include "canyon/relative/correction_link.hpp"
#include "canyon/simulation/correction_links.hpp"
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
    other.options.corrections.from = receiver.options.corrections.from;
    other.streets = receiver.streets;
    other.lever_arm_m = receiver.lever_arm_m;
    other.disturbances = receiver.disturbances;
    other.models = receiver.models;
    receiver = std::move(other);
  }
  visit(v, receiver);
  v.part("streets", receiver.streets);
  v.validate(receiver.options);
}

/// A base's own keys; all others are a profile's.
void visit_base(options::Visitor& v, LiveConfig& config) {
  if (!v.wants(v.reads() ? v.has("base") : config.base.has_value())) return;
  ReceiverConfig base = config.base.value_or(ReceiverConfig{});
  // East and north count from the host's origin, which LiveReceiver knows.
  CityConfig of_host;
  of_host.file.emplace();
  v.section("base", [&] {
    std::optional<std::string> name;
    if (!v.reads()) name = base.options.name;
    v.text(
        {"name", "", "of a base station in the host's world, whose epochs come with the receiver's", "base"},
        name);
    if (v.reads() && name) options::check_folder_name(v, "name", *name);
    visit_profile(v, base);
    if (v.reads()) base.options.name = name.value_or("base");
    if (v.reads()) v.require("fixed", "give its place: fixed: {east_m: ..., north_m: ..., up_m: ...}");
    visit_fixed(v, base.fixed, of_host);
    if (!v.reads()) return;
    base.options.own_draws = true;
    config.base = base;
    if (base.options.name == config.receiver.options.name) {
      throw v.fault("name", fmt::format("'{}' is the receiver's", base.options.name), "give it another one");
    }
  });
}

void check_base(options::Visitor& v, const LiveConfig& config) {
  if (!v.reads()) return;
  std::vector<ReceiverConfig> receivers{config.receiver};
  if (config.base) receivers.push_back(*config.base);
  const std::string& from = config.receiver.options.corrections.from;
  v.section("corrections", [&] {
    if (relative::is_stream(from)) {
      throw v.fault("from", fmt::format("'{}' is a stream, which hosts do not read", from),
                    "run it by canyon live, or give a base: {fixed: ...} and name that");
    }
    try {
      check_corrections(receivers, 0);
    } catch (const InputError& e) {
      throw v.fault("from", e.problem(), config.base ? e.cure() : "add base: {fixed: ...}");
    }
  });
}

}  // namespace

void visit(options::Visitor& v, LiveConfig& config) {
  if (v.reads() && !v.has("sky")) config.sky.nominal = true;
  v.part("sky", config.sky);
  visit_start(v, config.start);
  visit_rate(v, config.rate_hz);
  visit_seed(v, config.seed);
  v.number(
      {"geoid_undulation_m", "m",
       "height of mean sea level above the ellipsoid in the world, subtracted in NMEA, UBX, MAVLink and GPX",
       "the city's, else 0"},
      config.geoid_undulation_m, {-150, 150});
  visit_name_and_profile(v, config.receiver, false);
  // A host's receivers may be on several vehicles, whose errors are not alike.
  if (v.reads() || v.describes()) config.receiver.options.own_draws = true;
  visit(v, config.receiver);
  v.part("streets", config.receiver.streets);
  visit_base(v, config);
  if (v.reads() && has_base(config.receiver.options)) config.sky.errors.enabled.set_default(true);
  v.validate(config.receiver.options);
  check_base(v, config);
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
  std::vector<std::string> names{config.live.receiver.options.name};
  if (config.live.base) names.push_back(config.live.base->options.name);
  disturbance::visit_faults(v, config.live.faults, names);
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
  for (const char* fixed : {"name", "sky", "start", "base", "geoid_undulation_m"}) {
    const options::Node::Entry* entry = root.find(fixed);
    if (entry == nullptr) continue;
    throw InputError(name, entry->line, fmt::format("{}: cannot change while the receiver runs", fixed),
                     "write it in the receiver's configuration, and restart");
  }
  LiveConfig changed = config;
  RunningConfig running{changed};
  options::read(root, document, running);
  if (changed.receiver.options.corrections.from != config.receiver.options.corrections.from) {
    throw InputError(name, root.find("corrections")->line,
                     "corrections.from: cannot change while the receiver runs",
                     "write it in the receiver's configuration, and restart");
  }
  return changed;
}

}  // namespace canyon::simulation
