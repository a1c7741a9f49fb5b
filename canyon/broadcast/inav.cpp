#include <cmath>

#include "canyon/broadcast/accuracy_index.hpp"
#include "canyon/broadcast/messages.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::broadcast {

void put_galileo_time(Bits& bits, geodesy::GpsTime start, int week_bits) {
  bits.put(static_cast<std::uint64_t>(galileo_week(start)), week_bits);
  bits.put(static_cast<std::uint64_t>(start.nanosecond_of_week() / geodesy::GpsTime::kNanosecondsPerSecond),
           20);
}

Bits inav_word(const gnss::KeplerEphemeris& e, const SystemMessage& message, int type,
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
  whole(type, 6);
  if (type >= 1 && type <= 4) whole(e.iode, 10);
  switch (type) {
    case 0:
      bits.put(0b10, 2).put(0, 64).put(0, 24);
      put_galileo_time(bits, start);
      break;
    case 1:
      minutes(e.toe);
      angle(e.mean_anomaly, -31, 32);
      put(e.eccentricity, -33, 32, false);
      put(e.sqrt_a, -19, 32, false);
      bits.put(0, 2);
      break;
    case 2:
      angle(e.right_ascension, -31, 32);
      angle(e.inclination, -31, 32);
      angle(e.argument_of_perigee, -31, 32);
      angle(e.inclination_rate, -43, 14);
      bits.put(0, 2);
      break;
    case 3:
      angle(e.right_ascension_rate, -43, 24);
      angle(e.mean_motion_difference, -43, 16);
      put(e.cuc, -29, 16);
      put(e.cus, -29, 16);
      put(e.crc, -5, 16);
      put(e.crs, -5, 16);
      whole(sisa_index(e.accuracy_m), 8);
      break;
    case 4:
      whole(e.id.number, 6);
      put(e.cic, -29, 16);
      put(e.cis, -29, 16);
      minutes(e.toc);
      put(e.af0, -34, 31);
      put(e.af1, -46, 21);
      put(e.af2, -59, 6);
      bits.put(0, 2);
      break;
    case 5:
      put(message.nequick[0], -2, 11, false);
      put(message.nequick[1], -8, 11);
      put(message.nequick[2], -15, 14);
      bits.put(0, 5);  // storm flags of the five regions
      put(e.group_delay[0], -32, 10);
      put(e.group_delay[1], -32, 10);
      whole(e.health >> 7, 2);  // E5b HS, E1-B HS, E5b DVS, E1-B DVS
      whole(e.health >> 1, 2);
      whole(e.health >> 6, 1);
      whole(e.health, 1);
      put_galileo_time(bits, start);
      bits.put(0, 23);
      break;
    default: {  // 6: UTC is GST less whole seconds, no leap second announced
      const int week = galileo_week(start);
      bits.put(0, 32 + 24);
      whole(message.leap_seconds, 8);
      bits.put(0, 8);  // t_0t
      whole(week, 8);
      whole(week, 8);
      whole(7, 3);
      whole(message.leap_seconds, 8);
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
