#include "canyon/simulation/scenario/profile.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "canyon/base/input_error.hpp"
#include "canyon/base/named.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/simulation/scenario/scenario_fields.hpp"

namespace canyon::simulation {

namespace {

bool ends_with(std::string_view text, std::string_view end) {
  return text.size() > end.size() && text.substr(text.size() - end.size()) == end;
}

}  // namespace

const std::vector<ScenarioKey>& profile_keys() {
  static const std::vector<ScenarioKey> keys = [] {
    std::vector<ScenarioKey> all = options::description_of<ReceiverConfig>().keys;
    std::erase_if(all, [](const ScenarioKey& key) { return key.path.rfind("signal.shadowing.", 0) == 0; });
    return all;
  }();
  return keys;
}

void visit(options::Visitor& v, Profile& profile) {
  v.require("description", "describe the receiver in one line");
  v.text({"description", "", "one line"}, profile.description);
  visit(v, profile.receiver);
  v.section("signal", [&] {
    if (!v.reads() || !v.has("shadowing")) return;
    throw v.fault("shadowing", "obstacles belong to the world, not to a receiver",
                  "write surroundings: or shadowing: in the scenario (docs/shadowing.md)");
  });
  v.validate(profile.receiver.options);
}

const BuiltInProfile& built_in_profile(std::string_view name) {
  std::vector<std::string> names;
  for (const BuiltInProfile& profile : built_in_profiles()) {
    if (profile.name == name) return profile;
    names.emplace_back(profile.name);
  }
  throw InputError(fmt::format("'{}' is unknown", name),
                   known_names(name, names) + ", or your own file: ./my.yaml");
}

bool is_profile_path(std::string_view text) {
  return text.find('/') != std::string_view::npos || ends_with(text, ".yaml") || ends_with(text, ".yml");
}

Profile parse_profile(const std::string& text, const std::filesystem::path& name) {
  Profile profile;
  options::read_yaml(text, document_of(name, "profile"), "it needs at least description: ...", profile);
  return profile;
}

Profile read_profile(const std::filesystem::path& path) {
  constexpr std::size_t kMaxBytes = std::size_t{1} << 20;
  const TextFile file(path, kMaxBytes);
  return parse_profile(std::string(file.text()), path);
}

// Fields of receivers: names, profiles and the overrides of a scenario's own sections.
using options::Visitor;

namespace {

/// Trees and vehicles hide satellites from every antenna: they depend on its position, not on its profile.
ReceiverConfig among_obstacles(ReceiverConfig config) {
  config.options.signal.shadowing.enabled = true;
  config.options.signal.shadowing.environment = disturbance::ShadowingEnvironment::Auto;
  return config;
}

ReceiverConfig profile_of(Visitor& v, const std::string& name) {
  if (is_profile_path(name)) {
    std::optional<std::filesystem::path> file;
    v.file({"profile", "", "its file"}, file);
    return among_obstacles(read_profile(*file).receiver);
  }
  try {
    const BuiltInProfile& profile = built_in_profile(name);
    return among_obstacles(
        parse_profile(std::string(profile.text), fmt::format("profile {}", profile.name)).receiver);
  } catch (const InputError& e) {
    throw v.fault("profile", e.problem(), e.hint());
  }
}

/// A scenario's own sections, which apply to all its receivers.
void visit_sections_of_all(Visitor& v, ReceiverConfig& config) {
  v.part("propagation", config.propagation);
  v.part("noise", config.options.noise);
  disturbance::visit_environment(v, "surroundings", config.options.signal.shadowing.environment);
  v.part("shadowing", config.options.signal.shadowing);
}

}  // namespace

void visit_receivers(Visitor& v, std::vector<ReceiverConfig>& receivers, const CityConfig& city) {
  if (v.reads()) {
    if (!v.has("receivers")) receivers.assign(1, profile_of(v, std::string(kDefaultProfile)));
    // Defaults, then the profile, then the scenario's own sections, then the receiver's keys.
    std::vector<std::string> names;
    v.list("receivers", receivers, [&](ReceiverConfig& config) {
      visit_name_and_profile(v, config, receivers.size() > 1);
      if (std::find(names.begin(), names.end(), config.options.name) != names.end())
        throw v.fault("name", fmt::format("'{}' names two receivers", config.options.name),
                      "give each its own name");
      names.push_back(config.options.name);
    });
    if (names.empty()) receivers.front().options.name = "rover";
    for (ReceiverConfig& config : receivers) visit_sections_of_all(v, config);
  }
  v.list("receivers", receivers, [&](ReceiverConfig& config) {
    if (!v.reads()) visit_name_and_profile(v, config, false);
    visit_fixed(v, config.fixed, city);
    visit(v, config);
    v.validate(config.options);
  });
  if (v.reads()) {
    // After all are read: a base may be below its receiver in the list.
    v.list("receivers", receivers, [&](ReceiverConfig& config) {
      v.section("corrections", [&] {
        try {
          check_corrections(receivers, static_cast<std::size_t>(&config - receivers.data()));
        } catch (const InputError& e) {
          throw v.fault("from", e.problem(), e.hint());
        }
      });
    });
  }
  if (v.describes()) {
    ReceiverConfig defaults = among_obstacles({});
    visit_sections_of_all(v, defaults);
  }
}

void visit_profile(Visitor& v, ReceiverConfig& config) {
  v.replaced("preset", "did you mean 'profile'?");
  std::optional<std::string> profile;
  // The keys below have all values: the profile must not set a list or a table to which keys only add.
  if (!v.reads()) profile = kDefaultProfile;  // which sets no options::Switch
  v.text({"profile", "", "one of 'canyon profiles', or a profile file; the keys below override it",
          kDefaultProfile},
         profile);
  if (v.reads()) config = profile_of(v, profile.value_or(std::string(kDefaultProfile)));
}

bool has_idle_noise(const SkyConfig& sky, const ReceiverConfig& receiver) {
  const receiver::NoiseOptions& noise = receiver.options.noise;
  return sky.has_errors() && !noise.enabled.is_set() &&
         options::exact_text(noise) != options::exact_text(receiver::NoiseOptions());
}

std::string idle_noise_warning(const std::vector<std::string>& names) {
  return fmt::format(
      "noise{}{} has no effect, because range errors (sky.errors) replace it; set noise.enabled: true for "
      "both, or sky.errors.enabled: false",
      names.empty() ? "" : " of ", fmt::join(names, ", "));
}

void visit_name_and_profile(Visitor& v, ReceiverConfig& config, bool several) {
  std::optional<std::string> name;
  if (!v.reads()) name = config.options.name;
  v.text({"name", "", "name, used for outputs and noise; required with several receivers", "rover"}, name);
  if (v.reads()) {
    if (!name && several) throw v.fault({}, "a receiver has no name", "name each of several receivers");
    if (name) options::check_folder_name(v, "name", *name);
  }
  visit_profile(v, config);
  if (v.reads()) config.options.name = name.value_or("rover");
}

void visit(Visitor& v, ReceiverConfig& config) {
  visit(v, config.options);
  v.section("lever_arm", [&] {
    Eigen::Vector3d& arm = config.lever_arm_m;
    v.number({"forward_m", "m", "antenna ahead of the trajectory's point, rotated by its yaw"}, arm.x(),
             {-1000, 1000});
    v.number({"left_m", "m", "antenna to the left of that point"}, arm.y(), {-1000, 1000});
    v.number({"up_m", "m", "antenna above that point"}, arm.z(), {-1000, 1000});
  });
  v.part("propagation", config.propagation);
}

}  // namespace canyon::simulation
