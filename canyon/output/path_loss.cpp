#include "canyon/output/path_loss.hpp"

#include "canyon/gnss/signals.hpp"
#include "canyon/signal/path_strength.hpp"

namespace canyon::output {

std::complex<double> first_signal_amplitude(const receiver::SatelliteObservation& satellite,
                                            const propagation::SatelliteView& view,
                                            const propagation::Path& path,
                                            const tracking::SignalOptions& signal) {
  if (!signal.enabled) return 0;
  const gnss::Signal& first =
      satellite.signal != nullptr ? *satellite.signal : gnss::signals_of(satellite.id.system).front();
  const double carrier_hz = gnss::carrier_hz(first, view.line.state.carrier_frequency_hz);
  return signal::path_amplitude(path, view.line.elevation_rad, carrier_hz, signal.antenna, signal.strength);
}

}  // namespace canyon::output
