#include "canyon/outputs/encoding/encoder.hpp"

#include <cmath>

#include "canyon/base/named.hpp"
#include "canyon/receiver/random_streams.hpp"
#include "canyon/simulation/receiver_runner.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::encoding {

#define CANYON_FORMAT(name, file, live, wanted, help) Format{#name, file, live, help, encode_##name},
#define CANYON_STREAM_FORMAT(name, file) CANYON_FORMAT(name, file, true, false, "")
#define CANYON_RUN_OUTPUT(name, wanted, help)
constexpr Format kFormats[]{
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/scenario/outputs.def"
#include "canyon/simulation/simulator.hpp"
};

std::span<const Format> formats() {
  return kFormats;
}

const Format& format_named(std::string_view name) {
  for (const simulation::FormerOutput& former : simulation::former_outputs()) {
    if (name == former.name)
      throw InputError(std::string("output format '").append(name).append("' was removed"), former.hint);
  }
  return entry_named(kFormats, name, "output format");
}

ReceiverDescription describe_receiver(const simulation::ReceiverConfig& receiver, const orbit::Sky& sky,
                                      const gnss::NavigationData& navigation, geodesy::GpsTime begin,
                                      double interval_s) {
  const receiver::ReceiverOptions& options = receiver.options;
  ReceiverDescription description;
  description.name = options.name;
  description.tracks = options.tracks;
  description.signal = options.signal;
  description.rtk = options.rtk.enabled;
  description.dead_reckoning = options.dead_reckoning.enabled;
  description.interval_s = interval_s;
  description.begin = begin;
  description.elevation_mask_rad = options.fix.elevation_mask_rad;
  if (options.ionosphere) description.errors.emplace_back("ionosphere");
  if (options.troposphere) description.errors.emplace_back("troposphere");
  if (options.orbit_errors) description.errors.emplace_back("orbit and clock errors");
  if (receiver.fixed) description.station_ecef = geodesy::ecef_from_geodetic(receiver.fixed->position);
  for (const auto& record : navigation.glonass) description.glonass_channels[record.id] = record.channel;
  const double first_hz = gnss::l1_frequency_hz(gnss::System::GLONASS, 0);
  const double step_hz = gnss::l1_frequency_hz(gnss::System::GLONASS, 1) - first_hz;
  std::vector<const gnss::Signal*> tracked;
  for (const gnss::SatelliteId id : sky.satellites()) {
    receiver::signals_to_track(options, id, begin, tracked);
    if (tracked.empty()) continue;
    description.systems.insert(id.system);
    if (id.system != gnss::System::GLONASS || description.glonass_channels.count(id) > 0) continue;
    if (const auto state = sky.state(id, begin)) {
      const double channel = (state->carrier_frequency_hz - first_hz) / step_hz;
      description.glonass_channels[id] = static_cast<int>(std::lround(channel));
    }
  }
  return description;
}

std::vector<ReceiverDescription> describe_receivers(const simulation::ReceiverRunner& receiver,
                                                    double interval_s) {
  const simulation::RunnerConfig& config = receiver.config();
  const simulation::BuiltSky& sky = receiver.sky();
  const auto errors = simulation::make_range_errors(config.sky, sky, config.seed);
  const auto describe = [&](simulation::ReceiverConfig each) {
    simulation::decide_options(each.options, errors.get(), sky.sky.get());
    return describe_receiver(each, *sky.sky, sky.navigation, receiver.start(), interval_s);
  };
  std::vector<ReceiverDescription> descriptions;
  for (const simulation::ReceiverConfig& each : config.receivers) descriptions.push_back(describe(each));
  return descriptions;
}

ReceiverDescription describe_receiver(const simulation::Simulation& simulation, std::size_t receiver) {
  ReceiverDescription description =
      describe_receiver(simulation.scenario().receivers.at(receiver), simulation.environment().sky(),
                        simulation.navigation(), simulation.begin(), simulation.interval_s());
  description.ubx_generation = simulation.scenario().outputs.ubx_generation;
  return description;
}

}  // namespace canyon::encoding
