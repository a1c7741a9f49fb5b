#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "cli/recorded_drive.hpp"

namespace canyon::cli {

/// Arguments of `canyon validate` that draws of unknowns have as well, and their own.
struct EnsembleArguments : DriveArguments {
  std::optional<int> draws;
  std::string known;
  bool unsaid = false;
};
/// Adds --known, a list of names for unknowns::unknowns_of().
Option& add_known(Command& command, std::string& known);
/// Warns where 90 % intervals of so many draws hold less (caution_of_few()). @param option that says more
void warn_of_few_draws(std::size_t count, std::string_view option);
/// Adds --ensemble, --unsaid and --known.
void add_ensemble_options(Command& command, EnsembleArguments& arguments);

/// Simulates each recording with draws of what its scenario leaves open, and writes the intervals of its
/// figures beside the recorded ones. Ctrl-C ends it without results.
int run_ensemble(const EnsembleArguments& arguments);

}  // namespace canyon::cli
