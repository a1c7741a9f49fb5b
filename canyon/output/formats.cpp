#include "canyon/output/formats.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/simulation/live_receiver.hpp"
#include "canyon/simulation/scenario.hpp"

namespace canyon::output {

using simulation::OutputConfig;

// One line makes a format known to the command line, to scenarios and to every host.
constexpr std::array kFormats{
    Format{"epochs_csv", "epochs.csv", &OutputConfig::epochs_csv, true, encode_epochs_csv},
    Format{"satellites_csv", "satellites.csv", &OutputConfig::satellites_csv, true, encode_satellites_csv},
    Format{"signals_csv", "signals.csv", &OutputConfig::signals_csv, true, encode_signals_csv},
    Format{"paths_csv", "paths.csv", &OutputConfig::paths_csv, true, encode_paths_csv},
    Format{"nmea", "receiver.nmea", &OutputConfig::nmea, true, encode_nmea},
    Format{"gps_input", "gps_input.mavlink", &OutputConfig::gps_input, true, encode_gps_input},
    Format{"hil_gps", "hil_gps.mavlink", &OutputConfig::hil_gps, true, encode_hil_gps},
    Format{"gps_raw_int", "gps_raw_int.mavlink", &OutputConfig::gps_raw_int, true, encode_gps_raw_int},
    Format{"rtcm", "receiver.rtcm3", &OutputConfig::rtcm, true, encode_rtcm},
    Format{"ubx", "receiver.ubx", &OutputConfig::ubx, true, encode_ubx},
    Format{"ubx_m8", "receiver-m8.ubx", &OutputConfig::ubx_m8, true, encode_ubx_m8},
    Format{"view", "view.jsonl", nullptr, true, encode_view},
    Format{"rinex_observation", "receiver.obs", &OutputConfig::rinex_observation, false,
           encode_rinex_observation},
    Format{"rinex4_observation", "receiver.rnx", &OutputConfig::rinex4_observation, false,
           encode_rinex4_observation},
    Format{"kml", "track.kml", &OutputConfig::kml, false, encode_kml},
    Format{"geojson", "track.geojson", &OutputConfig::geojson, false, encode_geojson},
};

std::span<const Format> formats() {
  return kFormats;
}

const Format& format_named(std::string_view name) {
  std::vector<std::string> known;
  for (const Format& format : kFormats) {
    if (format.name == name) return format;
    known.emplace_back(format.name);
  }
  const auto similar = closest(std::string(name), known);
  throw InputError(fmt::format("there is no output format '{}'", name),
                   fmt::format("{}known: {}", similar ? fmt::format("did you mean '{}'? ", *similar) : "",
                               fmt::join(known, ", ")));
}

ReceiverDescription describe_receiver(const simulation::ReceiverConfig& receiver, const orbit::Sky& sky,
                                      const gnss::NavigationData& navigation, geodesy::GpsTime begin,
                                      double interval_s) {
  const receiver::ReceiverOptions& options = receiver.options;
  ReceiverDescription description;
  description.name = options.name;
  description.tracks = options.tracks;
  description.signal = options.signal;
  description.interval_s = interval_s;
  description.begin = begin;
  description.elevation_mask_rad = options.fix.elevation_mask_rad;
  if (receiver.fixed) description.station_ecef = geodesy::ecef_from_geodetic(receiver.fixed->place);
  for (const auto& record : navigation.glonass) description.glonass_channels[record.id] = record.channel;
  const double first_hz = gnss::l1_frequency_hz(gnss::System::GLONASS, 0);
  const double step_hz = gnss::l1_frequency_hz(gnss::System::GLONASS, 1) - first_hz;
  for (const gnss::SatelliteId id : sky.satellites()) {
    if (receiver::tracked_signals(options.tracks, id.system).empty()) continue;
    description.systems.insert(id.system);
    if (id.system != gnss::System::GLONASS || description.glonass_channels.count(id) > 0) continue;
    if (const auto state = sky.state(id, begin)) {
      const double channel = (state->carrier_frequency_hz - first_hz) / step_hz;
      description.glonass_channels[id] = static_cast<int>(std::lround(channel));
    }
  }
  return description;
}

std::vector<ReceiverDescription> describe_receivers(const simulation::LiveReceiver& receiver,
                                                    double interval_s) {
  const simulation::LiveConfig& config = receiver.config();
  const simulation::BuiltSky& sky = receiver.sky();
  const auto describe = [&](const simulation::ReceiverConfig& each) {
    return describe_receiver(each, *sky.sky, sky.navigation, receiver.start(), interval_s);
  };
  std::vector<ReceiverDescription> descriptions{describe(config.receiver)};
  if (config.base) descriptions.push_back(describe(*config.base));
  return descriptions;
}

ReceiverDescription describe_receiver(const simulation::Simulation& simulation, std::size_t receiver) {
  return describe_receiver(simulation.scenario().receivers.at(receiver), simulation.environment().sky(),
                           simulation.navigation(), simulation.begin(), simulation.interval_s());
}

}  // namespace canyon::output
