// Declared in canyon/broadcast/messages.hpp.
#include "canyon/broadcast/bits.hpp"
#include "canyon/broadcast/messages.hpp"
#include "canyon/gnss/broadcast_messages.hpp"

namespace canyon::broadcast {

Bits fnav_page(const gnss::KeplerEphemeris& e, const SystemMessage& message, int type,
               geodesy::GpsTime start) {
  Bits bits;
  const auto minutes = [&](geodesy::GpsTime t) { bits.positive(t.seconds_of_week(), 60, 14); };
  const int week = galileo_week(start);
  bits.count(type, 6);
  switch (type) {
    case 1: {
      // A clock of I/NAV is that of E1 and E5b: E1 is later than it by BGD(E1,E5b), than this one by
      // BGD(E1,E5a).
      const double af0 = e.af0 + (gnss::is_galileo_fnav(e) ? 0 : e.group_delay[0] - e.group_delay[1]);
      bits.count(e.id.number, 6);
      bits.count(e.iode, 10);
      minutes(e.toc);
      bits.number(af0, 0x1p-34, 31);
      bits.number(e.af1, 0x1p-46, 21);
      bits.number(e.af2, 0x1p-59, 6);
      bits.count(sisa_index(e.accuracy_m), 8);
      bits.positive(message.nequick[0], 0x1p-2, 11);
      bits.number(message.nequick[1], 0x1p-8, 11);
      bits.number(message.nequick[2], 0x1p-15, 14);
      bits.put(0, 5);  // storm flags of the five regions
      bits.number(e.group_delay[0], 0x1p-32, 10);
      bits.count(e.health >> 4, 2);
      put_galileo_time(bits, start);
      bits.count(e.health >> 3, 1);
      bits.put(0, 26);
      break;
    }
    case 2:
      bits.count(e.iode, 10);
      bits.angle(e.mean_anomaly, 0x1p-31, 32);
      bits.angle(e.right_ascension_rate, 0x1p-43, 24);
      bits.positive(e.eccentricity, 0x1p-33, 32);
      bits.positive(e.sqrt_a, 0x1p-19, 32);
      bits.angle(e.right_ascension, 0x1p-31, 32);
      bits.angle(e.inclination_rate, 0x1p-43, 14);
      put_galileo_time(bits, start);
      break;
    case 3:
      bits.count(e.iode, 10);
      bits.angle(e.inclination, 0x1p-31, 32);
      bits.angle(e.argument_of_perigee, 0x1p-31, 32);
      bits.angle(e.mean_motion_difference, 0x1p-43, 16);
      bits.number(e.cuc, 0x1p-29, 16);
      bits.number(e.cus, 0x1p-29, 16);
      bits.number(e.crc, 0x1p-5, 16);
      bits.number(e.crs, 0x1p-5, 16);
      minutes(e.toe);
      put_galileo_time(bits, start);
      bits.put(0, 8);
      break;
    case 4:  // UTC and GPST are GST less whole seconds, no leap second announced
      bits.count(e.iode, 10);
      bits.number(e.cic, 0x1p-29, 16);
      bits.number(e.cis, 0x1p-29, 16);
      bits.put(0, 32 + 24);
      bits.count(message.leap_seconds, 8);
      bits.put(0, 8);
      bits.count(week, 8);
      bits.count(week, 8);
      bits.count(7, 3);
      bits.count(message.leap_seconds, 8);
      bits.put(0, 8 + 16 + 12);
      put_galileo_time(bits, start, 6);
      bits.put(0, 5);
      break;
    default:  // 5, 6: an almanac of no satellite
      bits.put(0, 64).put(0, 64).put(0, 64).put(0, 16);
      break;
  }
  return bits.put(crc24q(bits), 24).put(0, 6);
}

}  // namespace canyon::broadcast
