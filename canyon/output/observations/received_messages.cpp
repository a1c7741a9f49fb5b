#include "canyon/output/observations/received_messages.hpp"

#include <utility>

#include "canyon/geodesy/constants.hpp"

namespace canyon::output {

using geodesy::GpsTime;

std::vector<broadcast::SentMessage> ReceivedMessages::received(const simulation::Epoch& epoch) {
  constexpr double kLongestGap_s = 60;
  std::map<gnss::SatelliteId, Tracked> tracked;
  std::vector<broadcast::SentMessage> messages;
  for (const receiver::SatelliteObservation& s : epoch.observed.satellites) {
    if (!s.measurement) continue;
    const GpsTime sent = epoch.observed.receiver_time - s.measurement->pseudorange_m / geodesy::kSpeedOfLight;
    const auto before = tracked_.find(s.id);
    // A new epoch of the clock, or a host that began again.
    const bool goes_on =
        before != tracked_.end() && sent > before->second.last && sent - before->second.last < kLongestGap_s;
    const Tracked now{goes_on ? before->second.since : sent, sent};
    tracked[s.id] = now;
    if (!goes_on || epoch.navigation == nullptr) continue;
    for (broadcast::SentMessage& message :
         schedule_.sent(*epoch.navigation, s.id, before->second.last, sent)) {
      if (message.start >= now.since) messages.push_back(std::move(message));
    }
  }
  tracked_ = std::move(tracked);
  return messages;
}

}  // namespace canyon::output
