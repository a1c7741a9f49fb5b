#include <fmt/format.h>

#include <memory>
#include <string>

#include "canyon/options/describe.hpp"
#include "canyon/simulation/scenario.hpp"
#include "cli/commands.hpp"

namespace canyon::cli {
namespace {

void add_show(CLI::App& group, Action& action) {
  const auto file = std::make_shared<std::string>();
  CLI::App* command = group.add_subcommand(
      "show", "print the effective scenario: profiles resolved, every default written out");
  command->add_option("scenario", *file, "scenario file (YAML)")->type_name("SCENARIO")->required();
  command->footer("What it prints is a scenario again, and gives the same files to the byte.");
  command->callback([&action, file] {
    action = [file] {
      simulation::ScenarioReadOptions options;
      options.trajectory_needed = false;
      fmt::print("{}", simulation::scenario_yaml(simulation::read_scenario(*file, options)));
      return kOk;
    };
  });
}

void add_schema(CLI::App& group, Action& action) {
  CLI::App* command =
      group.add_subcommand("schema", "print the JSON Schema (draft 7) of scenario files, for editors");
  command->footer(
      "With 'canyon scenario schema > scenario.schema.json', editors that speak YAML's language server "
      "complete and "
      "check\na file that begins with '# yaml-language-server: $schema=scenario.schema.json'.");
  command->callback([&action] {
    action = [] {
      fmt::print("{}", options::json_schema(simulation::scenario_description(), "Canyon scenario"));
      return kOk;
    };
  });
}

void add_keys(CLI::App& group, Action& action) {
  const auto as_markdown = std::make_shared<bool>(false);
  CLI::App* command = group.add_subcommand("keys", "list every key of a scenario: unit, default, meaning");
  command->add_flag("--markdown", *as_markdown, "as the table in docs/scenario.md");
  command->callback([&action, as_markdown] {
    action = [as_markdown] {
      const auto& keys = simulation::scenario_keys();
      fmt::print("{}", *as_markdown ? options::markdown(keys) : options::plain_text(keys));
      return kOk;
    };
  });
}

}  // namespace

void add_scenario(CLI::App& app, Action& action) {
  CLI::App* group = app.add_subcommand("scenario", "what a scenario file says, and what it may say");
  group->require_subcommand(1);
  add_show(*group, action);
  add_schema(*group, action);
  add_keys(*group, action);
}

}  // namespace canyon::cli
