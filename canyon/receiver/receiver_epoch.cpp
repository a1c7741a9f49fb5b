// Declared in canyon/receiver/receiver.hpp.
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/receiver/receiver.hpp"

namespace canyon::receiver {

geodesy::GpsTime ReceiverEpoch::stated(geodesy::GpsTime instant) const {
  return instant +
         static_cast<double>(events.weeks_off) * static_cast<double>(geodesy::GpsTime::kSecondsPerWeek);
}

geodesy::GpsTime ReceiverEpoch::stated_utc() const {
  if (events.weeks_off == 0 && events.utc_off_s == 0) return time;
  const geodesy::GpsTime stated = stated_time();
  return stated +
         static_cast<double>(geodesy::leap_seconds(stated) - geodesy::leap_seconds(time) + events.utc_off_s);
}

}  // namespace canyon::receiver
