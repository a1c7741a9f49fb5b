#pragma once

#include <map>

#include "canyon/geodesy/frames.hpp"
#include "canyon/gnss/navigation_data.hpp"
#include "canyon/propagation/arrival.hpp"
#include "canyon/receiver/receiver_options.hpp"

namespace canyon::receiver {

/// What a signal has on its way through space beside range and detours [m], as a receiver's options say: the
/// view's own where it has them, else those of the models that receivers correct by.
struct DelaysInSignal {
  double ionosphere_m = 0;  ///< of a code on this carrier; an advance of its phase
  double troposphere_m = 0;
  double orbit_error_m = 0;
};
/// @param place of the antenna. InputError where the ionosphere is asked for and has no coefficients.
[[nodiscard]] DelaysInSignal delays_in_signal(const ReceiverOptions& options,
                                              const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
                                              const propagation::SatelliteView& view, double carrier_hz,
                                              geodesy::GpsTime time, const geodesy::Geodetic& place);

}  // namespace canyon::receiver
