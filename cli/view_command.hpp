#pragma once

#include <CLI/CLI.hpp>

#include "cli/commands.hpp"

namespace canyon::cli {

/// Adds `canyon view`.
void add_view(CLI::App& app, Action& action);

}  // namespace canyon::cli
