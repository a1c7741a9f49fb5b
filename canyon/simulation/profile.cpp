#include "canyon/simulation/profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/simulation/scenario_keys.hpp"
#include "canyon/simulation/scenario_sections.hpp"

namespace canyon::simulation {
namespace {

bool ends_with(std::string_view text, std::string_view end) {
  return text.size() > end.size() && text.substr(text.size() - end.size()) == end;
}

std::vector<ScenarioKey> make_keys() {
  std::vector<ScenarioKey> keys;
  add_receiver_keys(keys, "");
  return keys;
}

}  // namespace

const std::vector<ScenarioKey>& profile_keys() {
  static const std::vector<ScenarioKey> keys = make_keys();
  return keys;
}

const BuiltInProfile& built_in_profile(std::string_view name) {
  std::vector<std::string> names;
  for (const BuiltInProfile& profile : built_in_profiles()) {
    if (profile.name == name) return profile;
    names.emplace_back(profile.name);
  }
  const std::optional<std::string> similar = closest(name, names);
  throw InputError(fmt::format("'{}' is unknown", name),
                   (similar ? fmt::format("did you mean '{}'? ", *similar) : "") +
                       fmt::format("known: {}, or a file of your own: ./my.yaml", fmt::join(names, ", ")));
}

bool is_profile_path(std::string_view text) {
  return text.find('/') != std::string_view::npos || ends_with(text, ".yaml") || ends_with(text, ".yml");
}

Profile parse_profile(const std::string& text, const std::filesystem::path& name) {
  std::vector<std::string> known{"description"};
  for (const ScenarioKey& key : profile_keys()) known.push_back(key.path);
  YamlSection root =
      YamlSection::parse(text, name, std::move(known), "profile", "it needs at least description: ...");
  Profile profile;
  const auto description = root.text("description");
  if (!description) {
    throw root.section_error("'description' is missing", "say in one line what receiver this is");
  }
  profile.description = *description;
  read_receiver_keys(root, profile.receiver);
  root.finish();
  return profile;
}

Profile read_profile(const std::filesystem::path& path) {
  constexpr std::size_t kMaxBytes = std::size_t{1} << 20;
  const TextFile file(path, kMaxBytes);
  return parse_profile(std::string(file.text()), path);
}

ReceiverConfig read_profile_key(YamlSection& section) {
  const auto name = section.text("profile");
  if (!name) return {};
  if (is_profile_path(*name)) return read_profile(*section.existing_file("profile")).receiver;
  try {
    const BuiltInProfile& profile = built_in_profile(*name);
    return parse_profile(std::string(profile.text), fmt::format("profile {}", profile.name)).receiver;
  } catch (const InputError& e) {
    throw section.error("profile", e.problem(), e.cure());
  }
}

}  // namespace canyon::simulation
