#include "canyon/receiver/signal_range.hpp"

#include <cmath>

#include "canyon/geodesy/constants.hpp"
#include "canyon/positioning/pseudorange_model.hpp"
#include "canyon/tracking/channel_rate.hpp"

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

SignalRange signal_range(const propagation::SatelliteView& view, const gnss::Signal& signal,
                         double carrier_hz, const ClockReading& clock, const RangeTerms& terms) {
  const orbit::LineOfSight& line = view.line;
  const DelaysInSignal& delays = terms.delays;
  SignalRange range;
  range.code_m = positioning::pseudorange_m(line, terms.code_excess_m, clock.bias_s,
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

}  // namespace canyon::receiver
