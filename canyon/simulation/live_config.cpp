#include <algorithm>

#include "canyon/simulation/live_receiver.hpp"
#include "canyon/simulation/scenario_sections.hpp"

namespace canyon::simulation {
namespace {

bool starts_with(const std::string& text, std::string_view start) {
  return text.compare(0, start.size(), start) == 0;
}

// A scenario's keys without those of city, trajectory and outputs; those of a receiver at the top.
std::vector<ScenarioKey> make_live_keys() {
  constexpr std::string_view kReceiver = "receivers[].";
  std::vector<ScenarioKey> keys;
  for (ScenarioKey key : scenario_keys()) {
    if (starts_with(key.path, kReceiver)) {
      key.path = key.path.substr(kReceiver.size());
    } else if (!starts_with(key.path, "sky.") && key.path != "start" && !starts_with(key.path, "start.") &&
               key.path != "rate_hz" && key.path != "seed") {
      continue;
    }
    keys.push_back(std::move(key));
  }
  return keys;
}

}  // namespace

const std::vector<ScenarioKey>& live_keys() {
  static const std::vector<ScenarioKey> keys = make_live_keys();
  return keys;
}

LiveConfig parse_live_config(const std::string& text, const std::filesystem::path& name) {
  std::vector<std::string> known;
  for (const ScenarioKey& key : live_keys()) known.push_back(key.path);
  YamlSection root = YamlSection::parse(text, name, std::move(known));

  LiveConfig config;
  if (auto sky = root.section("sky")) {
    config.sky = read_sky(*sky);
  } else {
    config.sky.nominal = true;
  }
  config.start = read_start(root);
  config.rate_hz = root.number("rate_hz", {0, 1000, true});
  config.seed = read_seed(root);
  const auto receiver_name = root.text("name");
  if (receiver_name) check_name(root, *receiver_name);
  config.receiver = read_profile_key(root);
  config.receiver.options.name = receiver_name.value_or("rover");
  read_receiver_keys(root, config.receiver);
  root.finish();
  return config;
}

}  // namespace canyon::simulation
