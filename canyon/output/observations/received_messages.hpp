#pragma once

#include <map>
#include <vector>

#include "canyon/broadcast/schedule.hpp"
#include "canyon/simulation/epoch.hpp"

namespace canyon::output {

/// The navigation messages that a receiver has received whole, epoch by epoch.
class ReceivedMessages {
 public:
  /// Messages that ended since the epoch before, of satellites tracked all along.
  std::vector<broadcast::SentMessage> received(const simulation::Epoch& epoch);

 private:
  struct Tracked {
    geodesy::GpsTime since, last;  ///< times of transmission
  };
  std::map<gnss::SatelliteId, Tracked> tracked_;
  broadcast::Schedule schedule_;
};

}  // namespace canyon::output
