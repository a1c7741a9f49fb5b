#include "canyon/receiver/random_streams.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

namespace canyon::receiver {

std::string stream_name(const ReceiverOptions& options) {
  return options.independent_noise && options.name != kReceiver ? options.name : "";
}

std::string disturbance_stream_name(const ReceiverOptions& options) {
  return options.independent_noise.is_set() ? stream_name(options) : "";
}

void signals_to_track(const ReceiverOptions& options, gnss::SatelliteId id, geodesy::GpsTime time,
                      std::vector<const gnss::Signal*>& found) {
  found = tracked_signals(options.tracks, id.system);
  leave_out(options, id, time, found);
}

void leave_out(const ReceiverOptions& options, gnss::SatelliteId id, geodesy::GpsTime time,
               std::vector<const gnss::Signal*>& found) {
  if (options.tracks.empty() && options.leaves_out.empty()) return;
  std::erase_if(found, [&](const gnss::Signal* signal) {
    return !gnss::transmits(id, *signal, time) ||
           std::any_of(options.leaves_out.begin(), options.leaves_out.end(),
                       [&](const std::string& group) { return gnss::in_group(group, id, *signal, time); });
  });
}

double fixed_bias_m(const BiasOptions& options, gnss::SatelliteId id, const gnss::Signal& signal,
                    double carrier_hz, geodesy::GpsTime time) {
  double bias_m = gnss::sum_of(options.code_m, id, signal, time);
  if (signal.channel_hz > 0)
    bias_m += options.glonass_channel_m * std::round((carrier_hz - signal.carrier_hz) / signal.channel_hz);
  return bias_m;
}

tracking::OuProcess bias_drift(const ReceiverOptions& options, std::uint64_t seed,
                               const gnss::Signal& signal) {
  const BiasOptions& o = options.biases;
  const tracking::OuOptions ou{1 / o.drift_time_s, 0, o.drift_sigma_m * std::sqrt(2 / o.drift_time_s)};
  const std::string key =
      fmt::format("{}/{}/{}/bias", stream_name(options), gnss::name(signal.system), signal.name);
  return {ou, RandomStream(seed, key)};
}

std::string noise_key(const ReceiverOptions& options, gnss::SatelliteId id, const gnss::Signal& signal) {
  std::string key = stream_name(options) + "/" + gnss::to_string(id);
  if (gnss::index_of(signal) > 0) key += fmt::format("/{}", signal.name);
  return key;
}

tracking::OuProcess pseudorange_noise(const ReceiverOptions& options, std::uint64_t seed,
                                      gnss::SatelliteId id, const gnss::Signal& signal) {
  return {options.noise.ou, RandomStream(seed, noise_key(options, id, signal) + "/code")};
}

}  // namespace canyon::receiver
