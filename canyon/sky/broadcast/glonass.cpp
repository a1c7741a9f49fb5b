#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/sky/broadcast/messages.hpp"

namespace canyon::broadcast {
namespace {

/// Day within the four years since the last leap year, from 1, and the number of these periods since 1996.
struct Calendar {
  std::uint64_t day = 1, four_years = 1;
};
Calendar four_year_calendar(const geodesy::CalendarTime& moscow) {
  const auto days = [](int year, int month, int day) {
    geodesy::CalendarTime c;
    c.year = year;
    c.month = month;
    c.day = day;
    return geodesy::gps_from_calendar(c).nanoseconds() / (86'400 * geodesy::GpsTime::kNanosecondsPerSecond);
  };
  const int first = moscow.year - moscow.year % 4;
  return {static_cast<std::uint64_t>(days(moscow.year, moscow.month, moscow.day) - days(first, 1, 1) + 1),
          static_cast<std::uint64_t>((first - 1996) / 4 + 1)};
}

/// Bits 8 to 1, after bits 85 to 9 (4.7): data bits are at the positions of a Hamming code that are no powers
/// of two, with bit 9 at position 3; the last parity bit covers all.
std::uint32_t check_bits(const Bits& data) {
  std::uint32_t check = 0;
  std::uint32_t index = 2;
  bool all = false;
  for (std::size_t i = data.size(); i-- > 0;) {  // bit 9 is last
    do ++index;
    while ((index & (index - 1)) == 0);
    if (!data[i]) continue;
    check ^= index;
    all = !all;
  }
  for (int i = 0; i < 7; ++i) all ^= (check >> i & 1) != 0;
  return check | static_cast<std::uint32_t>(all) << 7;
}

}  // namespace

Bits glonass_string(const gnss::GlonassEphemeris& e, int string, geodesy::GpsTime start) {
  const geodesy::CalendarTime frame = geodesy::glonass_from_gps(start);
  const geodesy::CalendarTime tb = geodesy::glonass_from_gps(e.toe);
  const Calendar calendar = four_year_calendar(frame);
  Bits bits;
  bits.put(0, 1).count(string, 4);
  const auto motion = [&](std::size_t axis) {
    bits.sign_magnitude(e.velocity_mps[axis] / 1e3, 0x1p-20, 24);
    bits.sign_magnitude(e.acceleration_mps2[axis] / 1e3, 0x1p-30, 5);
    bits.sign_magnitude(e.position_m[axis] / 1e3, 0x1p-11, 27);
  };
  switch (string) {
    case 1:
      bits.put(0, 2).put(0b01, 2);  // P1: tb changes every 30 min
      bits.count(frame.hour, 5).count(frame.minute, 6);
      bits.count(frame.second / 30, 1);
      motion(0);
      break;
    case 2: {
      const int quarter = tb.hour * 4 + tb.minute / 15;
      bits.put(e.health != 0 ? 0b100 : 0, 3).count(quarter % 2, 1).count(quarter, 7).put(0, 5);
      motion(1);
      break;
    }
    case 3:
      bits.put(0, 1);  // P3: four satellites' almanac in this frame
      bits.sign_magnitude(e.frequency_bias, 0x1p-40, 11);
      bits.put(0, 1).put(0b11, 2).put(0, 1);
      motion(2);
      break;
    case 4:
      bits.sign_magnitude(-e.clock_bias_s, 0x1p-30, 22);
      bits.sign_magnitude(e.group_delay_difference_s, 0x1p-30, 5);
      bits.positive(e.age_days, 1, 5);
      bits.put(0, 14).put(0, 1).put(2, 4).put(0, 3);  // P4; F_T 2: 2.5 m
      bits.put(calendar.day, 11).put(e.id.number, 5).put(1, 2);
      break;
    case 5:
      bits.put(calendar.day, 11).put(0, 32).put(0, 1).put(calendar.four_years, 5).put(0, 22).put(0, 1);
      break;
    default:
      bits.put(0, 64).put(0, 8);
      break;
  }
  return bits.put(check_bits(bits), 8);
}

}  // namespace canyon::broadcast
