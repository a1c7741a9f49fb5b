#include "cli/view_serve.hpp"
#include "cli/program.hpp"

#include <fmt/format.h>

#include <sys/resource.h>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <mutex>
#include <thread>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/outputs/encoding/view_messages.hpp"
#include "canyon/outputs/view/live_relay.hpp"
#include "canyon/outputs/view/page.hpp"
#include "canyon/outputs/view/probe.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "cli/commands.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {

namespace {

/// Prints the address of a server, and opens it in the browser if requested.
void announce(const view::Server& server, const ServeOptions& options) {
  fmt::print("{}\n", server.address());
  std::fflush(stdout);
  if (!options.quiet) fmt::print(stderr, "open it in a browser of this machine; Ctrl-C ends it\n");
  if (options.open && !(is_installed("xdg-open") && run_program({"xdg-open", server.address()}) == 0))
    fmt::print(stderr, "canyon: xdg-open does not open it; open it in a browser\n");
}

/// Antennas in a live view: a probe of the hosts' scenario at the time that they send.
class LiveProbe {
 public:
  explicit LiveProbe(const LiveView& view) : view_(view) {
    if (!view.scenario) why_not_ = "There is no scenario for tracing: start 'canyon view SCENARIO --live'.";
  }

  void begin(const view::ViewHeader& header) {
    if (!view_.scenario) return;
    simulation::Scenario scenario = *view_.scenario;
    scenario.receivers.clear();
    std::string why_not;
    for (const view::ReceiverHeader& receiver : header.receivers) {
      const auto& all = view_.scenario->receivers;
      const auto at = std::find_if(all.begin(), all.end(),
                                   [&](const auto& config) { return config.options.name == receiver.name; });
      if (at != all.end()) scenario.receivers.push_back(*at);
      if (at == all.end()) why_not = fmt::format("The scenario has no receiver '{}'.", receiver.name);
    }
    std::unique_ptr<view::Probe> made;
    try {
      if (why_not.empty()) {
        made = std::make_unique<view::Probe>(scenario, *header.begin, header.interval_s, view_.scene,
                                             view_.paths_per_satellite);
      }
    } catch (const InputError& error) {  // the host has a sky that this machine lacks
      why_not = error.what();
    }
    const std::lock_guard lock(mutex_);
    probe_ = std::move(made);
    why_not_ = std::move(why_not);
  }

  std::string handle_request(const std::string& message) {
    const std::lock_guard lock(mutex_);
    return probe_ ? probe_->handle_request(message) : view::no_probe(message, why_not_);
  }

 private:
  const LiveView& view_;
  std::mutex mutex_;
  std::unique_ptr<view::Probe> probe_;
  std::string why_not_ = "No host has sent its time yet.";
};

}  // namespace

int serve(view::ServedSite site, const ServeOptions& options,
          const std::function<bool(view::Server&)>& work) {
  const std::atomic<bool>& stop = catch_interrupts();
  view::Server server(std::move(site), {.port = options.port});
  announce(server, options);
  try {
    if (work && !work(server)) return kInterrupted;
  } catch (const std::exception& error) {
    server.send(encoding::error_message({}, error.what()));
    server.flush(std::chrono::seconds(1));
    throw;
  }
  while (!stop) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  return kOk;
}

void serve_live(LiveView view, const std::filesystem::path& folder, const ServeOptions& options) {
  setpriority(PRIO_PROCESS, 0, 10);  // the host must be on time, a view of it need not be
  LiveProbe probe(view);
  view::LiveRelay relay(view.addresses, std::move(view.header), folder, view.scene->scene);
  const std::atomic<bool>& stop = catch_interrupts();
  view::Server server({view::read_bytes(view::find_page()), folder,
                       [&probe](const std::string& message) { return probe.handle_request(message); }},
                      {.port = options.port});
  announce(server, options);
  while (!stop) {
    relay.serve(server);
    if (const auto header = relay.take_header()) probe.begin(*header);
    for (const std::string& note : relay.take_notes())
      if (!options.quiet) fmt::print(stderr, "{}\n", note);
  }
}

}  // namespace canyon::cli
