#pragma once

#include <map>

#include "canyon/disturbance/receiver_events.hpp"
#include "canyon/gnss/satellite_id.hpp"
#include "canyon/tracking/signal_options.hpp"

// What a restart takes from a receiver.

namespace canyon::receiver {

/// Options of channels that search for everything.
[[nodiscard]] inline tracking::SignalOptions searching_anew(tracking::SignalOptions options,
                                                            const disturbance::Restart& restart) {
  options.lock.cold_acquisition_s = restart.search_s;
  options.lock.warm_start = false;
  return options;
}

/// Whose ephemerides a receiver has read since it began anew.
class KnownEphemerides {
 public:
  /// @param needed_s a satellite must be tracked for so long; 0: all are known
  explicit KnownEphemerides(double needed_s = 0) : needed_s_(needed_s) {}

  /// Once an epoch. @param tracking it now @param step_s since the epoch before
  [[nodiscard]] bool read(gnss::SatelliteId id, bool tracking, double step_s) {
    if (needed_s_ == 0) return true;
    Tracked& tracked = tracked_[id];
    if (tracking && tracked.before) tracked.so_far_s += step_s;
    tracked.before = tracking;
    return tracked.so_far_s >= needed_s_;
  }

 private:
  struct Tracked {
    double so_far_s = 0;
    bool before = false;  // at the epoch before
  };
  double needed_s_;
  std::map<gnss::SatelliteId, Tracked> tracked_;
};

}  // namespace canyon::receiver
