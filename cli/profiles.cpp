// Declared in cli/commands.hpp.
#include <fmt/format.h>

#include "canyon/simulation/scenario/profile.hpp"
#include "cli/commands.hpp"

namespace canyon::cli {
namespace {

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

}  // namespace

void add_profiles(Command& app) {
  Command& command = app.add_command("profiles", "list the built-in receiver profiles, or print one");
  std::string& name = command.run_with(run_profiles);
  command.add_option("profile", name, "NAME", "profile to print");
  command.footer =
      "In a scenario: 'receivers: [{profile: NAME}]', or 'profile: ./FILE.yaml' for a file of your own.";
}

}  // namespace canyon::cli
