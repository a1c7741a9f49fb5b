#include <fmt/format.h>

#include <gazebo/common/Console.hh>

#include "adapters/gazebo_classic/local_server.hpp"
#include "adapters/gazebo_classic/publishers.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/output/nmea.hpp"

namespace canyon::gazebo_classic {
namespace {

LocalServer open_server(int port) {
  try {
    return LocalServer(port);
  } catch (const InputError& e) {
    throw InputError("nmea_port: " + e.problem(), e.cure());
  }
}

class NmeaPublisher final : public EpochPublisher {
 public:
  NmeaPublisher(const ReceiverIdentity& identity, const PluginSettings& settings)
      : name_(fmt::format("plugin '{}' of '{}', nmea_port {}", identity.plugin, identity.link,
                          settings.nmea_port)),
        server_(open_server(settings.nmea_port)) {}

  void publish(const ReceiverReport& report) override {
    server_.serve();
    // Without truth there is no epoch, and a receiver that says nothing is what readers take for a lost one.
    if (report.step != nullptr && server_.clients() > 0) server_.send(output::nmea_epoch(report.step->epoch));
    for (const std::string& note : server_.take_notes()) {
      gzwarn << "[canyon] " << name_ << ": " << note << "\n";
    }
  }

 private:
  std::string name_;  ///< for messages
  LocalServer server_;
};

}  // namespace

std::unique_ptr<EpochPublisher> make_nmea_publisher(const ReceiverIdentity& identity,
                                                    const PluginSettings& settings) {
  return std::make_unique<NmeaPublisher>(identity, settings);
}

}  // namespace canyon::gazebo_classic
