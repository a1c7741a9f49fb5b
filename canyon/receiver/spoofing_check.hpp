#pragma once

#include <map>
#include <optional>

#include "canyon/receiver/receiver.hpp"

namespace canyon::receiver {

/// Signs of spoofing in a receiver's own measurements; the truth is never used:
/// - The gain control reduces the gain, but signals do not weaken as they do under noise (D. M. Akos,
///   Navigation 59(4), 2012): in a band, 10 log10(1 + interference / noise) is at least gain_db, and the mean
///   C/N0 is within half of that of its mean over the minute before.
/// - The fix's position, or clock, differs by at least jump_m from the prediction by velocity, or drift, from
///   the last fix, at most 5 s ago.
/// Interference outside a signal's main lobe but inside the front end looks like the first. A slow pull-off
/// with little power triggers neither.
class SpoofingCheck {
 public:
  explicit SpoofingCheck(const SpoofingCheckOptions& options) : options_(options) {}

  /// Epochs in order of time. Each check stays failed for hold_s.
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
