#pragma once

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

}  // namespace canyon::cli
