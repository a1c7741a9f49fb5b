#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"

namespace canyon::disturbance {

/// Knowledge of a receiver that begins anew: all; time and place, no ephemerides; nothing.
enum class RestartKind : std::uint8_t { Hot, Warm, Cold };

/// A receiver that begins anew.
struct Restart {
  geodesy::GpsTime at;  ///< one instant is one restart
  RestartKind kind = RestartKind::Cold;
  std::optional<double> search_s{};     ///< from a signal's presence to its first measurement; empty: its own
  std::optional<double> ephemeris_s{};  ///< a satellite is tracked for so long before its use; empty: its own
};

/// Events of a receiver itself at one epoch, whatever arrives at its antenna.
struct ReceiverEvents {
  /// Offsets of the oscillator, added to the receiver's own clock [s, s/s].
  double clock_bias_s = 0, clock_drift = 0;
  /// Errors of the date that the firmware states: GPS weeks, and seconds of UTC.
  int weeks_off = 0, utc_off_s = 0;
  std::optional<Restart> restart{};
  std::vector<std::string> faults{};  ///< names of those at work (FaultTimeline)
};

}  // namespace canyon::disturbance
