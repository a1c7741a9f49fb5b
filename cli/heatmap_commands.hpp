#pragma once

#include <CLI/CLI.hpp>

#include "cli/commands.hpp"

namespace canyon::cli {

/// `canyon heatmap query`.
CLI::App* add_heatmap_query(CLI::App& heatmap, Action& action);
/// `canyon heatmap judge`.
CLI::App* add_heatmap_judge(CLI::App& heatmap, Action& action);

}  // namespace canyon::cli
