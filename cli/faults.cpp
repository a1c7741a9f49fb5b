// Declared in cli/commands.hpp.
#include <fmt/format.h>

#include "canyon/disturbance/faults/fault.hpp"
#include "canyon/options/describe.hpp"
#include "cli/commands.hpp"

namespace canyon::cli {
namespace {

int list() {
  std::vector<TextRow> rows;
  for (const disturbance::FaultKind& kind : disturbance::fault_kinds()) {
    rows.push_back({std::string(kind.name), std::string(kind.summary)});
  }
  print_table({"fault", "what happens"}, rows);
  fmt::print("\n'canyon faults list KIND' describes one with its keys.\n");
  return kOk;
}

int describe(const std::string& name) {
  const disturbance::FaultKind& kind = disturbance::fault_kind_named(name);
  std::vector<options::Key> keys = disturbance::description(kind).keys;
  for (options::Key& key : keys) {
    if (const std::string values = key.values(); !values.empty()) key.meaning += fmt::format(" ({})", values);
  }
  fmt::print(
      "{}: {}\n\nKeys below '{}:', in addition to the fault's own name, from_s, until_s or duration_s, "
      "receivers:\n{}\nExample:\nfaults:\n  - {}\n",
      kind.name, kind.summary, kind.name, options::plain_text(keys), kind.example);
  return kOk;
}

}  // namespace

void add_faults(Command& app) {
  Command& group = app.add_command("faults", "list faults that can be simulated");
  const auto kind = std::make_shared<std::string>();
  Command& command = group.add_command("list", "list the kinds of faults, or describe one with its keys");
  command.add_option("kind", *kind, "KIND", "describe this one");
  command.footer = "In a scenario: 'faults: [...]', a timeline; see docs/faults.md.";
  command.action = [kind] { return kind->empty() ? list() : describe(*kind); };
}

}  // namespace canyon::cli
