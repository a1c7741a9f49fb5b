#pragma once

#include <map>
#include <optional>

#include "canyon/receiver/receiver.hpp"

namespace canyon::receiver {

/// Signs of spoofing in a receiver's own measurements; the truth is never used:
/// - its gain control gives way, but signals do not weaken with it, as they do amid noise (D. M. Akos,
///   Navigation 59(4), 2012): in a band, 10 log10(1 + interference / noise) is gain_db and more, and the mean
///   C/N0 is within half of that of its mean over a minute before;
/// - the fix's place, or clock, is off what its own velocity, or drift, says since the fix before, at most
///   5 s ago, by jump_m and more.
/// Interference beside a signal's main lobe but within the front end looks like the first; a slow pull-off
/// without much power shows in neither.
class SpoofingCheck {
 public:
  explicit SpoofingCheck(const SpoofingCheckOptions& options) : options_(options) {}

  /// Epochs in order of time. Each check counts for hold_s after it failed.
  [[nodiscard]] SpoofingState update(const ReceiverEpoch& epoch);

 private:
  struct Strength {
    double mean_dbhz = 0;
    geodesy::GpsTime time;
  };
  [[nodiscard]] bool gain_without_loss(const ReceiverEpoch& epoch);
  [[nodiscard]] bool jumped(const ReceiverEpoch& epoch) const;

  SpoofingCheckOptions options_;
  std::map<double, Strength> strengths_;  // by carrier
  std::optional<positioning::Fix> fix_;
  geodesy::GpsTime fix_time_;
  std::optional<geodesy::GpsTime> gain_failed_, jump_failed_;
};

}  // namespace canyon::receiver
