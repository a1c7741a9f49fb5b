#include "canyon/receiver/signal_range.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "canyon/geodesy/constants.hpp"
#include "canyon/positioning/pseudorange_model.hpp"
#include "canyon/tracking/channel_fading.hpp"

namespace canyon::receiver {

namespace {

using geodesy::kSpeedOfLight;

/// A turn of the carrier is given at L1, and is of one delay on every carrier's scale: metres of a radian.
double metres_per_turned_rad(double carrier_hz) {
  const double cycles_per_rad = gnss::kL1_hz / carrier_hz / (2 * geodesy::kPi);
  return cycles_per_rad * kSpeedOfLight / carrier_hz;
}

}  // namespace

DelaysInSignal delays_in_signal(const ReceiverOptions& options,
                                const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
                                const propagation::SatelliteView& view, double carrier_hz,
                                geodesy::GpsTime time, const geodesy::Geodetic& place) {
  DelaysInSignal delays;
  if (view.space) {
    const double rate = std::pow(gnss::kL1_hz / carrier_hz, 2);
    if (options.ionosphere) delays.ionosphere_m = rate * view.space->ionosphere_m;
    if (options.troposphere) delays.troposphere_m = view.space->troposphere_m;
    if (options.orbit_errors) delays.orbit_error_m = view.space->orbit_clock_m;
    return delays;
  }
  const orbit::LineOfSight& line = view.line;
  const auto delay_m = [&](bool ionosphere, bool troposphere) {
    return positioning::atmosphere_m(ionosphere, troposphere, klobuchar, line.id.system, carrier_hz, time,
                                     place, {line.azimuth_rad, line.elevation_rad});
  };
  delays.ionosphere_m = delay_m(options.ionosphere, false);
  delays.troposphere_m = delay_m(false, options.troposphere);
  return delays;
}

double pseudorange_m(const orbit::LineOfSight& line, double excess_m, double bias_s, double atmosphere_m,
                     double noise_m) {
  return line.range_m + excess_m +
         geodesy::kSpeedOfLight * (bias_s - (line.state.clock_bias_s - line.state.group_delay_s)) +
         atmosphere_m + noise_m;
}

SignalRange signal_range(const propagation::SatelliteView& view, const gnss::Signal& signal,
                         double carrier_hz, const ClockReading& clock, const RangeTerms& terms) {
  const orbit::LineOfSight& line = view.line;
  const DelaysInSignal& delays = terms.delays;
  SignalRange range;
  range.code_m = pseudorange_m(line, terms.code_excess_m, clock.bias_s,
                               delays.ionosphere_m + delays.troposphere_m, terms.code_noise_m);
  range.code_m += terms.bias_m + delays.orbit_error_m;
  // The broadcast clock holds the group delay of the satellite's first signal, for which this is 0.
  range.code_m += kSpeedOfLight * (line.state.group_delay_of(signal) - line.state.group_delay_s);
  range.carrier_m = line.range_m + terms.carrier_excess_m +
                    kSpeedOfLight * (clock.bias_s - line.state.clock_bias_s) + delays.troposphere_m -
                    delays.ionosphere_m + delays.orbit_error_m +
                    view.carrier_turn_rad * metres_per_turned_rad(carrier_hz);
  return range;
}

SignalRate signal_rate(const propagation::SatelliteView& view, double carrier_hz,
                       const propagation::Path& path, const tracking::AntennaMotion& motion,
                       const ClockReading& clock, double atmosphere_mps) {
  const orbit::LineOfSight& line = view.line;
  const double geometry = tracking::path_rate_mps(line, motion.velocity_ecef, path, motion.ecef_from_enu) +
                          kSpeedOfLight * (clock.drift - line.state.clock_drift);
  return {geometry / (1 + clock.drift) + path.code_ahead_mps,
          (geometry + atmosphere_mps) / (1 + clock.drift) +
              view.carrier_turn_radps * metres_per_turned_rad(carrier_hz)};
}

std::string draws_of(const ReceiverOptions& options) {
  return options.own_draws && options.name != kReceiver ? options.name : "";
}

std::string disturbance_draws_of(const ReceiverOptions& options) {
  return options.own_draws.is_set() ? draws_of(options) : "";
}

void signals_to_track(const ReceiverOptions& options, gnss::SatelliteId id, geodesy::GpsTime time,
                      std::vector<const gnss::Signal*>& found) {
  found = tracked_signals(options.tracks, id.system);
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
  if (signal.channel_hz > 0) {
    bias_m += options.glonass_channel_m * std::round((carrier_hz - signal.carrier_hz) / signal.channel_hz);
  }
  return bias_m;
}

tracking::OuProcess bias_drift(const ReceiverOptions& options, std::uint64_t seed,
                               const gnss::Signal& signal) {
  const BiasOptions& o = options.biases;
  const tracking::OuOptions ou{1 / o.drift_time_s, 0, o.drift_sigma_m * std::sqrt(2 / o.drift_time_s)};
  const std::string key =
      fmt::format("{}/{}/{}/bias", draws_of(options), gnss::name(signal.system), signal.name);
  return {ou, RandomStream(seed, key)};
}

std::string noise_key(const ReceiverOptions& options, gnss::SatelliteId id, const gnss::Signal& signal) {
  std::string key = draws_of(options) + "/" + gnss::to_string(id);
  if (gnss::index_of(signal) > 0) key += fmt::format("/{}", signal.name);
  return key;
}

tracking::OuProcess pseudorange_noise(const ReceiverOptions& options, std::uint64_t seed,
                                      gnss::SatelliteId id, const gnss::Signal& signal) {
  return {options.noise.ou, RandomStream(seed, noise_key(options, id, signal) + "/code")};
}

}  // namespace canyon::receiver
