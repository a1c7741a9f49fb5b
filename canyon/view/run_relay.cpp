#include "canyon/view/run_relay.hpp"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/output/encoder.hpp"
#include "canyon/output/view_messages.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/view/skyline.hpp"

namespace canyon::view {

struct RunRelay::Impl {
  using Clock = std::chrono::steady_clock;

  struct Receiver {
    output::EpochRows rows;
    MovingSkyline skyline;
  };

  Impl(const simulation::Simulation& s, Server& to, std::size_t paths, std::chrono::milliseconds each)
      : simulation(s), server(to), step(each) {
    for (std::size_t i = 0; i < s.scenario().receivers.size(); ++i) {
      descriptions.push_back(output::describe_receiver(s, i));
      receivers.push_back({output::EpochRows(descriptions.back().signal, paths), MovingSkyline()});
    }
    hello = output::hello_message(descriptions);
    server.greet({hello});
  }

  /// All receivers of an instant, or none.
  bool due(geodesy::GpsTime instant) {
    if (shown == instant) return true;
    const auto now = Clock::now();
    if (server.clients() == 0 || (shown && now - last < step)) return false;
    shown = instant;
    last = now;
    return true;
  }

  const simulation::Simulation& simulation;
  Server& server;
  std::chrono::milliseconds step;
  std::vector<output::ReceiverDescription> descriptions;
  std::vector<Receiver> receivers;
  std::string hello;
  std::optional<geodesy::GpsTime> shown;
  Clock::time_point last;
};

RunRelay::RunRelay(const simulation::Simulation& simulation, Server& server, std::size_t paths_per_satellite,
                   std::chrono::milliseconds step)
    : impl_(std::make_unique<Impl>(simulation, server, paths_per_satellite, step)) {}
RunRelay::~RunRelay() = default;

void RunRelay::write(const simulation::Epoch& epoch) {
  Impl& impl = *impl_;
  if (!impl.due(epoch.truth.time)) return;
  const simulation::Environment& environment = impl.simulation.environment();
  const geodesy::LocalFrame& frame = environment.city().frame;
  Impl::Receiver& receiver = impl.receivers.at(epoch.receiver);
  receiver.skyline.move(environment.scene(), frame.local_from_ecef(epoch.truth_ecef));
  output::EpochMessage message;
  message.receiver = impl.descriptions[epoch.receiver].name;
  message.time_s = epoch.observed.time - impl.simulation.begin();
  message.skyline = receiver.skyline.bytes();
  impl.server.send(output::epoch_message(
      std::move(message), epoch, [&](const Eigen::Vector3d& ecef) { return frame.local_from_ecef(ecef); },
      receiver.rows));
}

void RunRelay::progress(std::size_t done, std::size_t planned) {
  const std::string text = output::progress_message(done, planned);
  impl_->server.greet({impl_->hello, text});
  impl_->server.send(text);
}

void RunRelay::finished() {
  const std::string text = output::finished_message();
  impl_->server.greet({impl_->hello, text});
  impl_->server.send(text);
}

}  // namespace canyon::view
