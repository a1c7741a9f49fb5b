#pragma once

#include <optional>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/receiver/fix_history.hpp"
#include "canyon/receiver/receiver.hpp"

namespace canyon::receiver {

/// The stage after a Receiver: replaces its computed fixes by those that faults report
/// (ReceiverEvents::forced, fix_edits). Receivers never use the result: their filters, dead reckoning and
/// spoofing checks continue from the computed fixes. The default state is that of a receiver as constructed.
class FixFaults {
 public:
  /// Changes ReceiverEpoch::fix, single_epoch and SatelliteObservation::used. Epochs in order of time.
  /// @param antenna of the epoch
  void apply(const propagation::Antenna& antenna, ReceiverEpoch& epoch);

 private:
  /// Edits of one of an epoch's two fixes.
  struct Edits {
    void apply(const ReceiverEpoch& epoch, positioning::Fix& fix);

    FixHistory fixes;
    std::optional<geodesy::GpsTime> last, back;  // the last fix; the first one after an outage
  };

  Edits fix_, single_epoch_;
};

}  // namespace canyon::receiver
