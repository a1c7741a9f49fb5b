// Declared in canyon/broadcast/messages.hpp.
#include "canyon/broadcast/bits.hpp"
#include "canyon/broadcast/messages.hpp"

namespace canyon::broadcast {

void put_galileo_time(Bits& bits, geodesy::GpsTime start, int week_bits) {
  bits.count(galileo_week(start), week_bits);
  bits.put(static_cast<std::uint64_t>(start.nanosecond_of_week() / geodesy::GpsTime::kNanosecondsPerSecond),
           20);
}

Bits inav_word(const gnss::KeplerEphemeris& e, const SystemMessage& message, int type,
               geodesy::GpsTime start) {
  Bits bits;
  const auto minutes = [&](geodesy::GpsTime t) { bits.positive(t.seconds_of_week(), 60, 14); };
  bits.count(type, 6);
  if (type >= 1 && type <= 4) bits.count(e.iode, 10);
  switch (type) {
    case 0:
      bits.put(0b10, 2).put(0, 64).put(0, 24);
      put_galileo_time(bits, start);
      break;
    case 1:
      minutes(e.toe);
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
      bits.number(e.cuc, 0x1p-29, 16);
      bits.number(e.cus, 0x1p-29, 16);
      bits.number(e.crc, 0x1p-5, 16);
      bits.number(e.crs, 0x1p-5, 16);
      bits.count(sisa_index(e.accuracy_m), 8);
      break;
    case 4:
      bits.count(e.id.number, 6);
      bits.number(e.cic, 0x1p-29, 16);
      bits.number(e.cis, 0x1p-29, 16);
      minutes(e.toc);
      bits.number(e.af0, 0x1p-34, 31);
      bits.number(e.af1, 0x1p-46, 21);
      bits.number(e.af2, 0x1p-59, 6);
      bits.put(0, 2);
      break;
    case 5:
      bits.positive(message.nequick[0], 0x1p-2, 11);
      bits.number(message.nequick[1], 0x1p-8, 11);
      bits.number(message.nequick[2], 0x1p-15, 14);
      bits.put(0, 5);  // storm flags of the five regions
      bits.number(e.group_delay[0], 0x1p-32, 10);
      bits.number(e.group_delay[1], 0x1p-32, 10);
      bits.count(e.health >> 7, 2);  // E5b HS, E1-B HS, E5b DVS, E1-B DVS
      bits.count(e.health >> 1, 2);
      bits.count(e.health >> 6, 1);
      bits.count(e.health, 1);
      put_galileo_time(bits, start);
      bits.put(0, 23);
      break;
    default: {  // 6: UTC is GST less whole seconds, no leap second announced
      const int week = galileo_week(start);
      bits.put(0, 32 + 24);
      bits.count(message.leap_seconds, 8);
      bits.put(0, 8);  // t_0t
      bits.count(week, 8);
      bits.count(week, 8);
      bits.count(7, 3);
      bits.count(message.leap_seconds, 8);
      bits.put(
          static_cast<std::uint64_t>(start.nanosecond_of_week() / geodesy::GpsTime::kNanosecondsPerSecond),
          20);
      bits.put(0, 3);
      break;
    }
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

}  // namespace canyon::broadcast
