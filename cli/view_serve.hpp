#pragma once

#include <filesystem>
#include <string>

#include "canyon/city/city.hpp"
#include "canyon/view/header.hpp"
#include "canyon/view/server.hpp"

namespace canyon::cli {

struct ServeOptions {
  int port = 0;       ///< 0: a free one
  bool open = false;  ///< in the user's browser
  bool quiet = false;
};

/// Prints the address of a server, and has the browser open it where that is asked for.
void announce(const view::Server& server, const ServeOptions& options);

/// Serves a view until Ctrl-C.
void serve(view::Site site, const ServeOptions& options);

/// Serves what a host sends to `address` as the stream "view", in a city, until Ctrl-C.
/// @param header of the city, whose mesh is in `folder` already
void serve_live(const std::string& address, view::Header header, city::City city,
                const std::filesystem::path& folder, const ServeOptions& options);

}  // namespace canyon::cli
