#pragma once

#include <optional>
#include <string>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"

namespace canyon::disturbance {

/// A receiver that begins anew.
struct Restart {
  geodesy::GpsTime at;     ///< one instant is one restart
  double search_s = 0;     ///< from a signal's presence to its first measurement
  double ephemeris_s = 0;  ///< for so long a satellite must be tracked before the fix uses it
};

/// What happens to a receiver itself at one epoch, whatever arrives at its antenna.
struct ReceiverEvents {
  /// Of the oscillator, added to the receiver's own clock [s, s/s].
  double clock_bias_s = 0, clock_drift = 0;
  /// Errors of the date that the firmware states: GPS weeks, and seconds of UTC.
  int weeks_off = 0, utc_off_s = 0;
  std::optional<Restart> restart{};
  std::vector<std::string> faults{};  ///< names of those at work (FaultTimeline)
};

}  // namespace canyon::disturbance
