#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/outputs/view/header.hpp"
#include "canyon/outputs/view/server.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "cli/arguments.hpp"

namespace canyon::cli {

struct ServeOptions {
  int port = 0;       ///< 0: a free one
  bool open = false;  ///< in the user's browser
  bool quiet = false;
};

/// Serves a view until Ctrl-C, and returns the exit status. @param work done meanwhile; returns false if
/// Ctrl-C has ended it. If it throws, pages get the reason, and the exception passes through
int serve(view::ServedSite site, const ServeOptions& options,
          const std::function<bool(view::Server&)>& work = {});

/// The view of `canyon view --live`.
struct LiveView {
  std::vector<std::string> addresses;            ///< of the hosts' streams "view"
  view::ViewHeader header;                       ///< of the city, whose mesh is already in the folder
  std::shared_ptr<simulation::CityScene> scene;  ///< the city
  /// The hosts' scenario, if known: pages use it to add antennas.
  std::optional<simulation::Scenario> scenario = {};
  std::size_t paths_per_satellite = 12;
};
/// Serves the hosts' data, in a city, until Ctrl-C.
void serve_live(LiveView view, const std::filesystem::path& folder, const ServeOptions& options);

}  // namespace canyon::cli
