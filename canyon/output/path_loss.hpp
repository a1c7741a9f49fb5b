#pragma once

#include <complex>

#include "canyon/propagation/arrival.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/tracking/signal_options.hpp"

namespace canyon::output {

/// Amplitude of a path of the satellite's first tracked signal over that of its clear line of sight
/// (signal::path_amplitude()); 0 where signals have no strength.
[[nodiscard]] std::complex<double> first_signal_amplitude(const receiver::SatelliteObservation& satellite,
                                                          const propagation::SatelliteView& view,
                                                          const propagation::Path& path,
                                                          const tracking::SignalOptions& signal);

/// Calls `take(satellite, view)` for each satellite of an epoch whose paths are known; nothing without
/// `arrival`.
template <typename Take>
void for_each_view(const receiver::ReceiverEpoch& observed, const propagation::Arrival* arrival,
                   const Take& take) {
  if (arrival == nullptr) return;
  auto satellite = observed.satellites.begin();
  const auto end = observed.satellites.end();
  for (const propagation::SatelliteView& view : arrival->views) {  // both ascend
    while (satellite != end && satellite->id < view.line.id) ++satellite;
    if (satellite == end) break;
    if (satellite->id == view.line.id) take(*satellite, view);
  }
}

}  // namespace canyon::output
