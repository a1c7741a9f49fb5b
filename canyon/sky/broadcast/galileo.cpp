#include "canyon/sky/broadcast/bits.hpp"
#include "canyon/sky/broadcast/messages.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::broadcast {

namespace {

int galileo_week(geodesy::GpsTime t) {
  return t.week() - 1024;  // OS SIS ICD 2.1, 5.1.2
}

void put_second(Bits& bits, geodesy::GpsTime start) {
  bits.count(start.nanosecond_of_week() / geodesy::GpsTime::kNanosecondsPerSecond, 20);
}
/// GST: the last bits of the week, the second of the week.
void put_galileo_time(Bits& bits, geodesy::GpsTime start, int week_bits = 12) {
  put_second(bits.count(galileo_week(start), week_bits), start);
}
void put_minutes(Bits& bits, geodesy::GpsTime t) {
  bits.positive(t.seconds_of_week(), 60, 14);
}
void put_galileo_clock(Bits& bits, const gnss::KeplerEphemeris& e, double af0) {
  put_minutes(bits, e.toc);
  bits.number(af0, 0x1p-34, 31).number(e.af1, 0x1p-46, 21).number(e.af2, 0x1p-59, 6);
}
/// Cuc, Cus, Crc, Crs.
void put_harmonics(Bits& bits, const gnss::KeplerEphemeris& e) {
  bits.number(e.cuc, 0x1p-29, 16).number(e.cus, 0x1p-29, 16);
  bits.number(e.crc, 0x1p-5, 16).number(e.crs, 0x1p-5, 16);
}
void put_nequick(Bits& bits, const SystemMessage& message) {
  bits.positive(message.nequick[0], 0x1p-2, 11);
  bits.number(message.nequick[1], 0x1p-8, 11);
  bits.number(message.nequick[2], 0x1p-15, 14);
  bits.put(0, 5);  // storm flags of the five regions
}
/// UTC is GST minus whole seconds, no leap second announced.
void put_galileo_utc(Bits& bits, const SystemMessage& message, geodesy::GpsTime start) {
  const int week = galileo_week(start);
  bits.put(0, 32 + 24).count(message.leap_seconds, 8);
  bits.put(0, 8);  // t_0t
  bits.count(week, 8).count(week, 8).count(7, 3).count(message.leap_seconds, 8);
}

}  // namespace

Bits inav_word(const gnss::KeplerEphemeris& e, const SystemMessage& message, int type,
               geodesy::GpsTime start) {
  Bits bits;
  bits.count(type, 6);
  if (type >= 1 && type <= 4) bits.count(e.iode, 10);
  switch (type) {
    case 0:
      bits.put(0b10, 2).put(0, 64).put(0, 24);
      put_galileo_time(bits, start);
      break;
    case 1:
      put_minutes(bits, e.toe);
      bits.angle(e.mean_anomaly, 0x1p-31, 32);
      bits.positive(e.eccentricity, 0x1p-33, 32);
      bits.positive(e.sqrt_a, 0x1p-19, 32);
      bits.put(0, 2);
      break;
    case 2:
      bits.angle(e.right_ascension, 0x1p-31, 32);
      bits.angle(e.inclination, 0x1p-31, 32);
      bits.angle(e.argument_of_perigee, 0x1p-31, 32);
      bits.angle(e.inclination_rate, 0x1p-43, 14);
      bits.put(0, 2);
      break;
    case 3:
      bits.angle(e.right_ascension_rate, 0x1p-43, 24);
      bits.angle(e.mean_motion_difference, 0x1p-43, 16);
      put_harmonics(bits, e);
      bits.count(sisa_index(e.accuracy_m), 8);
      break;
    case 4:
      bits.count(e.id.number, 6);
      bits.number(e.cic, 0x1p-29, 16);
      bits.number(e.cis, 0x1p-29, 16);
      put_galileo_clock(bits, e, e.af0);
      bits.put(0, 2);
      break;
    case 5:
      put_nequick(bits, message);
      bits.number(e.group_delay[0], 0x1p-32, 10);
      bits.number(e.group_delay[1], 0x1p-32, 10);
      bits.count(e.health >> 7, 2);  // E5b HS, E1-B HS, E5b DVS, E1-B DVS
      bits.count(e.health >> 1, 2);
      bits.count(e.health >> 6, 1);
      bits.count(e.health, 1);
      put_galileo_time(bits, start);
      bits.put(0, 23);
      break;
    default:  // 6
      put_galileo_utc(bits, message, start);
      put_second(bits, start);
      bits.put(0, 3);
      break;
  }
  return bits;
}

std::vector<std::uint32_t> inav_page(const Bits& word) {
  Bits even, odd;
  even.put(0b00, 2).put(word.number(0, 64), 64).put(word.number(64, 48), 48);
  odd.put(0b10, 2).put(word.number(112, 16), 16).put(0, 40 + 22).put(0, 2);  // reserved 1, SAR, spare
  Bits checked = even;
  checked.append(odd);
  odd.put(crc24q(checked), 24).put(0, 8);  // reserved 2
  even.put(0, 6 + 8);                      // tail, filled to four words
  odd.put(0, 6 + 8);
  return even.append(odd).words32();
}

Bits fnav_page(const gnss::KeplerEphemeris& e, const SystemMessage& message, int type,
               geodesy::GpsTime start) {
  Bits bits;
  bits.count(type, 6);
  switch (type) {
    case 1: {
      // An I/NAV clock refers to E1 and E5b: E1's delay is BGD(E1,E5b) relative to it, and BGD(E1,E5a)
      // relative to this one.
      const double af0 = e.af0 + (gnss::is_galileo_fnav(e) ? 0 : e.group_delay[0] - e.group_delay[1]);
      bits.count(e.id.number, 6);
      bits.count(e.iode, 10);
      put_galileo_clock(bits, e, af0);
      bits.count(sisa_index(e.accuracy_m), 8);
      put_nequick(bits, message);
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
      put_harmonics(bits, e);
      put_minutes(bits, e.toe);
      put_galileo_time(bits, start);
      bits.put(0, 8);
      break;
    case 4:  // GPST is GST likewise
      bits.count(e.iode, 10);
      bits.number(e.cic, 0x1p-29, 16);
      bits.number(e.cis, 0x1p-29, 16);
      put_galileo_utc(bits, message, start);
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
