#include "canyon/receiver/observation.hpp"

#include <algorithm>

#include "canyon/base/geodesy/time_scales.hpp"

namespace canyon::receiver {

geodesy::GpsTime ReceiverEpoch::reported(geodesy::GpsTime instant) const {
  return instant +
         static_cast<double>(events.weeks_off) * static_cast<double>(geodesy::GpsTime::kSecondsPerWeek);
}

geodesy::GpsTime ReceiverEpoch::reported_utc() const {
  if (events.weeks_off == 0 && events.utc_off_s == 0) return time;
  const geodesy::GpsTime reported = reported_time();
  return reported + static_cast<double>(geodesy::leap_seconds(reported) - geodesy::leap_seconds(time) +
                                        events.utc_off_s);
}

void ReceiverEpoch::update_used() {
  for (SatelliteObservation& satellite : satellites)
    satellite.used = std::binary_search(fix.used.begin(), fix.used.end(), satellite.id);
}

}  // namespace canyon::receiver
