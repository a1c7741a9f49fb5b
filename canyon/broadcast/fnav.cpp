#include <cmath>

#include "canyon/broadcast/accuracy_index.hpp"
#include "canyon/broadcast/messages.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/gnss/broadcast_messages.hpp"

namespace canyon::broadcast {

Bits fnav_page(const gnss::KeplerEphemeris& e, const SystemMessage& message, int type,
               geodesy::GpsTime start) {
  Bits bits;
  const auto put = [&](double value, int exponent, int width, bool is_signed = true) {
    bits.put_scaled(value, std::ldexp(1.0, exponent), width, is_signed);
  };
  const auto angle = [&](double value, int exponent, int width) {
    put(value / geodesy::kPi, exponent, width);
  };
  const auto whole = [&](int value, int width) { bits.put(static_cast<std::uint64_t>(value), width); };
  const auto minutes = [&](geodesy::GpsTime t) { bits.put_scaled(t.seconds_of_week(), 60, 14, false); };
  const int week = galileo_week(start);
  whole(type, 6);
  switch (type) {
    case 1: {
      // A clock of I/NAV is that of E1 and E5b: E1 is later than it by BGD(E1,E5b), than this one by
      // BGD(E1,E5a).
      const double af0 = e.af0 + (gnss::is_galileo_fnav(e) ? 0 : e.group_delay[0] - e.group_delay[1]);
      whole(e.id.number, 6);
      whole(e.iode, 10);
      minutes(e.toc);
      put(af0, -34, 31);
      put(e.af1, -46, 21);
      put(e.af2, -59, 6);
      whole(sisa_index(e.accuracy_m), 8);
      put(message.nequick[0], -2, 11, false);
      put(message.nequick[1], -8, 11);
      put(message.nequick[2], -15, 14);
      bits.put(0, 5);  // storm flags of the five regions
      put(e.group_delay[0], -32, 10);
      whole(e.health >> 4, 2);
      put_galileo_time(bits, start);
      whole(e.health >> 3, 1);
      bits.put(0, 26);
      break;
    }
    case 2:
      whole(e.iode, 10);
      angle(e.mean_anomaly, -31, 32);
      angle(e.right_ascension_rate, -43, 24);
      put(e.eccentricity, -33, 32, false);
      put(e.sqrt_a, -19, 32, false);
      angle(e.right_ascension, -31, 32);
      angle(e.inclination_rate, -43, 14);
      put_galileo_time(bits, start);
      break;
    case 3:
      whole(e.iode, 10);
      angle(e.inclination, -31, 32);
      angle(e.argument_of_perigee, -31, 32);
      angle(e.mean_motion_difference, -43, 16);
      put(e.cuc, -29, 16);
      put(e.cus, -29, 16);
      put(e.crc, -5, 16);
      put(e.crs, -5, 16);
      minutes(e.toe);
      put_galileo_time(bits, start);
      bits.put(0, 8);
      break;
    case 4:  // UTC and GPST are GST less whole seconds, no leap second announced
      whole(e.iode, 10);
      put(e.cic, -29, 16);
      put(e.cis, -29, 16);
      bits.put(0, 32 + 24);
      whole(message.leap_seconds, 8);
      bits.put(0, 8);
      whole(week, 8);
      whole(week, 8);
      whole(7, 3);
      whole(message.leap_seconds, 8);
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
