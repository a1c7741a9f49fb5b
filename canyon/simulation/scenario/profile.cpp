#include "canyon/simulation/scenario/profile.hpp"

#include <fmt/format.h>

#include "canyon/base/input_error.hpp"
#include "canyon/base/named.hpp"
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
                   known_names(name, names) + ", or a file of your own: ./my.yaml");
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

}  // namespace canyon::simulation
