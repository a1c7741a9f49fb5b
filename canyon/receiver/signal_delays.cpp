#include "canyon/receiver/signal_delays.hpp"

#include <cmath>

#include "canyon/positioning/pseudorange_model.hpp"

namespace canyon::receiver {

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

}  // namespace canyon::receiver
