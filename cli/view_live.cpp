#include <fmt/format.h>
#include <sys/resource.h>

#include <string>

#include "canyon/simulation/city_scene.hpp"
#include "canyon/view/live_relay.hpp"
#include "canyon/view/page.hpp"
#include "canyon/view/probe.hpp"
#include "cli/interrupt.hpp"
#include "cli/view_serve.hpp"

namespace canyon::cli {

void serve_live(const std::string& address, view::Header header, city::City city,
                const std::filesystem::path& folder, const ServeOptions& options) {
  setpriority(PRIO_PROCESS, 0, 10);  // the host has to be on time, a picture of it has not
  const simulation::CityScene scene(std::move(city));
  view::LiveRelay relay(address, std::move(header), folder, scene.scene);
  view::ServerOptions bounds;
  bounds.port = options.port;
  const std::atomic<bool>& stop = catch_interrupts();
  view::Server server({view::read_bytes(view::find_page()), folder,
                       [](const std::string& message) {
                         return view::no_probe(message, "Antennas are not put into a live view.");
                       }},
                      bounds);
  announce(server, options);
  while (!stop) {
    relay.serve(server);
    for (const std::string& note : relay.take_notes()) {
      if (!options.quiet) fmt::print(stderr, "{}: {}\n", address, note);
    }
  }
}

}  // namespace canyon::cli
