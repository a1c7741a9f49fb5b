#include "cli/view_serve.hpp"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <string>
#include <thread>

#include "cli/interrupt.hpp"

namespace canyon::cli {
namespace {

/// False where there is nothing that opens addresses.
bool open_in_browser(std::string address) {
  std::string program = "xdg-open";
  std::array<char*, 3> arguments{program.data(), address.data(), nullptr};
  pid_t child = 0;
  if (posix_spawnp(&child, program.c_str(), nullptr, nullptr, arguments.data(), environ) != 0) return false;
  int status = 0;
  return waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace

void announce(const view::Server& server, const ServeOptions& options) {
  fmt::print("{}\n", server.address());
  std::fflush(stdout);
  if (!options.quiet) fmt::print(stderr, "open it in a browser of this machine; Ctrl-C ends it\n");
  if (options.open && !open_in_browser(server.address())) {
    fmt::print(stderr, "canyon: xdg-open does not open it; do so by hand\n");
  }
}

void serve(view::Site site, const ServeOptions& options) {
  view::ServerOptions bounds;
  bounds.port = options.port;
  const std::atomic<bool>& stop = catch_interrupts();
  const view::Server server(std::move(site), bounds);
  announce(server, options);
  while (!stop) std::this_thread::sleep_for(std::chrono::milliseconds(50));
}

}  // namespace canyon::cli
