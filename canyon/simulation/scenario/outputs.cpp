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
#include "canyon/base/options/visitor.hpp"
#include "canyon/simulation/scenario/outputs.def"
};

constexpr std::string_view kWithGeneration = "ubx";
constexpr std::string_view kLayouts = "write sensors_npz: examples/layouts.py converts it to this file";
constexpr FormerOutput kFormer[]{
    {"ubx_m8", "write ubx: {generation: m8}, of a stream ubx=ADDRESS?generation=m8"},
    {"ubx_m10", "write ubx: {generation: m10}, of a stream ubx=ADDRESS?generation=m10"},
    {"ubx_x20", "write ubx: {generation: x20}, of a stream ubx=ADDRESS?generation=x20"},
    {"ubx_hpg151", "write ubx, an F9 with HPG 1.32"},
    {"novatel", "write sbf, ubx or rinex_observation"},
    {"novatel_binary", "write sbf, ubx or rinex_observation"},
    {"gnsslogger", "write rinex_observation"},
    {"kf_gins", kLayouts},
    {"gici", kLayouts},
    {"urbannav_gt", kLayouts},
};

}  // namespace

std::span<const Output> outputs() {
  return kAll;
}

std::span<const FormerOutput> former_outputs() {
  return kFormer;
}

void visit_generation(options::Visitor& v, UbxGeneration& generation) {
  static constexpr std::string_view kNames[]{"m8", "f9", "m10", "x20"};
  v.choice({"generation", "",
            "ubx: as sent by a u-blox M8 (SPG 3.01), F9 (HPG 1.32), M10 (SPG 5.30) or X20 (HPG 2.10)"},
           generation, kNames);
}

OutputConfig::OutputConfig() {
  for (const Output& output : outputs())
    if (output.wanted) names.emplace(output.name);
}

void OutputConfig::validate() const {
  for (const std::string& name : names) (void)entry_named(outputs(), name, "output");
}

void visit(options::Visitor& v, OutputConfig& o) {
  for (const Output& output : outputs()) {
    bool wanted = o.has(output.name);
    if (output.name == kWithGeneration) {
      v.section(output.name, [&] {
        if (v.reads()) wanted = true;
        v.boolean({"enabled", "", output.help}, wanted);
        visit_generation(v, o.ubx_generation);
      });
    } else {
      v.boolean({output.name, "", output.help}, wanted);
    }
    o.names.erase(std::string(output.name));
    if (wanted) o.names.emplace(output.name);
  }
  for (const FormerOutput& former : former_outputs()) v.replaced(former.name, former.hint);
}

void visit_outputs(options::Visitor& v, OutputConfig& config) {
  const bool section = v.is_section("outputs");
  if (v.describes() || (v.reads() && v.has("outputs") && !section)) {
    std::vector<std::string> listed;
    std::vector<std::string_view> known;
    for (const Output& output : outputs()) known.push_back(output.name);
    v.words(
        {"outputs", "", "list of names: only these; or a mapping: names to add and to leave out", "as below"},
        listed, known);
    if (!listed.empty()) config.names = {listed.begin(), listed.end()};
    if (v.reads()) return;
  }
  v.part("outputs", config);
}

}  // namespace canyon::simulation
