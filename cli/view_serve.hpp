#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/outputs/view/header.hpp"
#include "canyon/outputs/view/server.hpp"
#include "canyon/run/environment.hpp"
#include "canyon/run/scenario/scenario.hpp"
#include "cli/arguments.hpp"

namespace canyon::cli {

struct ServeOptions {
  int port = 0;       ///< 0: a free one
  bool open = false;  ///< in the user's browser
  bool quiet = false;
};

/// Serves a view until Ctrl-C, and returns the exit status. @param work that is done meanwhile; false where
/// Ctrl-C has ended it. Where it throws pages are sent the reason, and the exception goes on
int serve(view::ServedSite site, const ServeOptions& options,
          const std::function<bool(view::Server&)>& work = {});

/// The view of `canyon view --live`.
struct LiveView {
  std::vector<std::string> addresses;            ///< of the hosts' streams "view"
  view::ViewHeader header;                       ///< of the city, whose mesh is in the folder already
  std::shared_ptr<simulation::CityScene> scene;  ///< the city
  /// The hosts' scenario, if known: pages put antennas by it.
  std::optional<simulation::Scenario> scenario = {};
  std::size_t paths_per_satellite = 12;
};
/// Serves what hosts send, in a city, until Ctrl-C.
void serve_live(LiveView view, const std::filesystem::path& folder, const ServeOptions& options);

}  // namespace canyon::cli
