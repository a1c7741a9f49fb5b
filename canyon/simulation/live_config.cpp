#include "canyon/simulation/live_receiver.hpp"
#include "canyon/simulation/scenario_fields.hpp"

namespace canyon::simulation {

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

LiveConfig parse_live_config(const std::string& text, const std::filesystem::path& name) {
  LiveConfig config;
  parse(text, name, live_description(), "scenario", "it needs at least city, sky and trajectory", config);
  return config;
}

}  // namespace canyon::simulation
