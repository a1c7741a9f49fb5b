#include <fmt/format.h>

#include "canyon/base/options/describe.hpp"
#include "canyon/paths/disturbance/faults/fault.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "cli/commands.hpp"
#include "cli/scenario_run.hpp"

namespace canyon::cli {
namespace {

int show(const std::string& file) {
  print_scenario(simulation::read_scenario(file, {false}));
  return kOk;
}

void add_show(Command& group) {
  Command& command =
      group.add_command("show", "print the effective scenario: profiles resolved, every default written out");
  std::string& file = command.run_with(show);
  command.add_option("scenario", file, "SCENARIO", "scenario file (YAML)").required();
  command.footer =
      "The output is a scenario that gives the same files, equal to the byte. Passwords of addresses are "
      "left out.";
}

void add_schema(Command& group) {
  Command& command =
      group.add_command("schema", "print the JSON Schema (draft 7) of scenario files, for editors");
  command.footer =
      "With 'canyon scenario schema > scenario.schema.json', editors that support YAML's language server "
      "complete and "
      "check\na file that begins with '# yaml-language-server: $schema=scenario.schema.json'.";
  command.action = [] {
    fmt::print("{}", options::json_schema(simulation::scenario_description(), "Canyon scenario"));
    return kOk;
  };
}

void add_keys(Command& group) {
  const auto as_markdown = std::make_shared<bool>(false);
  Command& command = group.add_command("keys", "list every key of a scenario: unit, default, meaning");
  command.add_flag("--markdown", *as_markdown, "print the table of docs/reference/keys.md");
  command.action = [as_markdown] {
    const auto& keys = simulation::scenario_keys();
    fmt::print("{}", *as_markdown ? options::markdown(keys) : options::plain_text(keys));
    return kOk;
  };
}

int run_profiles(const std::string& name) {
  if (!name.empty()) {
    fmt::print("{}", simulation::built_in_profile(name).text);
    return kOk;
  }
  std::vector<TextRow> rows;
  for (const simulation::BuiltInProfile& profile : simulation::built_in_profiles()) {
    const std::string profile_name(profile.name);
    rows.push_back(
        {profile_name, simulation::parse_profile(std::string(profile.text), profile_name).description});
  }
  print_table({"profile", "receiver"}, rows);
  return kOk;
}

int list() {
  std::vector<TextRow> rows;
  for (const disturbance::FaultKind& kind : disturbance::fault_kinds())
    rows.push_back({std::string(kind.name), std::string(kind.summary)});
  print_table({"fault", "what happens"}, rows);
  fmt::print("\n'canyon faults list KIND' describes one with its keys.\n");
  return kOk;
}

int describe(const std::string& name) {
  const disturbance::FaultKind& kind = disturbance::fault_kind_named(name);
  std::vector<options::Key> keys = disturbance::description(kind).keys;
  for (options::Key& key : keys)
    if (const std::string values = key.values(); !values.empty()) key.meaning += fmt::format(" ({})", values);
  fmt::print(
      "{}: {}\n\nKeys below '{}:', in addition to the fault's own name, from_s, until_s or duration_s, "
      "receivers:\n{}\nExample:\nfaults:\n  - {}\n",
      kind.name, kind.summary, kind.name, options::plain_text(keys), kind.example);
  return kOk;
}

}  // namespace

void add_scenario(Command& app) {
  Command& group = app.add_command("scenario", "show a scenario with its defaults, and list all keys");
  add_show(group);
  add_schema(group);
  add_keys(group);
}

void add_profiles(Command& app) {
  Command& command = app.add_command("profiles", "list the built-in receiver profiles, or print one");
  std::string& name = command.run_with(run_profiles);
  command.add_option("profile", name, "NAME", "profile to print");
  command.footer =
      "In a scenario: 'receivers: [{profile: NAME}]', or 'profile: ./FILE.yaml' for your own file.";
}

void add_faults(Command& app) {
  Command& group = app.add_command("faults", "list faults that can be simulated");
  const auto kind = std::make_shared<std::string>();
  Command& command = group.add_command("list", "list the kinds of faults, or describe one with its keys");
  command.add_option("kind", *kind, "KIND", "describe this one");
  command.footer = "In a scenario: 'faults: [...]', a timeline; see docs/faults.md.";
  command.action = [kind] { return kind->empty() ? list() : describe(*kind); };
}

}  // namespace canyon::cli
