#include "cli/view_serve.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <thread>

#include "canyon/output/view_messages.hpp"
#include "cli/commands.hpp"
#include "cli/interrupt.hpp"
#include "cli/program.hpp"

namespace canyon::cli {

void announce(const view::Server& server, const ServeOptions& options) {
  fmt::print("{}\n", server.address());
  std::fflush(stdout);
  if (!options.quiet) fmt::print(stderr, "open it in a browser of this machine; Ctrl-C ends it\n");
  if (options.open && !(is_installed("xdg-open") && run_program({"xdg-open", server.address()}) == 0)) {
    fmt::print(stderr, "canyon: xdg-open does not open it; do so by hand\n");
  }
}

int serve(view::Site site, const ServeOptions& options, const std::function<bool(view::Server&)>& work) {
  view::ServerOptions bounds;
  bounds.port = options.port;
  const std::atomic<bool>& stop = catch_interrupts();
  view::Server server(std::move(site), bounds);
  announce(server, options);
  try {
    if (work && !work(server)) return kInterrupted;
  } catch (const std::exception& error) {
    server.send(output::error_message({}, error.what()));
    server.flush(std::chrono::seconds(1));
    throw;
  }
  while (!stop) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  return kOk;
}

}  // namespace canyon::cli
