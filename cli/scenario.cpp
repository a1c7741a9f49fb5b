// Declared in cli/commands.hpp.
#include <fmt/format.h>

#include "canyon/options/describe.hpp"
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
      "With 'canyon scenario schema > scenario.schema.json', editors that speak YAML's language server "
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
  command.add_flag("--markdown", *as_markdown, "print the table of docs/scenario.md");
  command.action = [as_markdown] {
    const auto& keys = simulation::scenario_keys();
    fmt::print("{}", *as_markdown ? options::markdown(keys) : options::plain_text(keys));
    return kOk;
  };
}

}  // namespace

void add_scenario(Command& app) {
  Command& group = app.add_command("scenario", "show a scenario with its defaults, and list all keys");
  add_show(group);
  add_schema(group);
  add_keys(group);
}

}  // namespace canyon::cli
