#include "canyon/simulation/scenario/outputs.hpp"

#include <vector>

#include "canyon/base/named.hpp"
#include "canyon/simulation/scenario/scenario_fields.hpp"

namespace canyon::simulation {
namespace {

#define CANYON_FORMAT(name, file, live, wanted, help) Output{#name, wanted, help},
#define CANYON_STREAM_FORMAT(name, file)
#define CANYON_RUN_OUTPUT(name, wanted, help) Output{#name, wanted, help},
constexpr Output kAll[]{
#include "canyon/simulation/scenario/outputs.def"
};

}  // namespace

std::span<const Output> outputs() {
  return kAll;
}

OutputConfig::OutputConfig() {
  for (const Output& output : outputs()) {
    if (output.wanted) names.emplace(output.name);
  }
}

void OutputConfig::validate() const {
  for (const std::string& name : names) (void)entry_named(outputs(), name, "output");
}

void visit(options::Visitor& v, OutputConfig& o) {
  for (const Output& output : outputs()) {
    bool wanted = o.has(output.name);
    v.boolean({output.name, "", output.help}, wanted);
    o.names.erase(std::string(output.name));
    if (wanted) o.names.emplace(output.name);
  }
}

void visit_outputs(options::Visitor& v, OutputConfig& config) {
  const bool section = v.is_section("outputs");
  if (v.describes() || (v.reads() && v.has("outputs") && !section)) {
    std::vector<std::string> listed;
    std::vector<std::string_view> known;
    for (const Output& output : outputs()) known.push_back(output.name);
    v.words(
        {"outputs", "", "list of names: only these; or a mapping: which to add and to leave out", "as below"},
        listed, known);
    if (!listed.empty()) config.names = {listed.begin(), listed.end()};
    if (v.reads()) return;
  }
  v.part("outputs", config);
}

}  // namespace canyon::simulation
