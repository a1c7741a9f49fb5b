// Declared in canyon/broadcast/messages.hpp.
#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "canyon/broadcast/bits.hpp"
#include "canyon/broadcast/messages.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::broadcast {
namespace {

using geodesy::GpsTime;

/// Reference values of difference fields (IS-GPS-200 tables 30-I and 30-II; IS-QZSS-PNT-005 table 4.3.2-16).
constexpr double kSemiMajorAxis_m = 26'559'710, kSemiMajorAxisOfQzss_m = 42'164'200;
constexpr double kRightAscensionRate = -2.6e-9 * geodesy::kPi;
constexpr double kEarthGm = 3.986005e14;  ///< of GPS, 20.3.3.4.3
constexpr double kGpsDelayStep_s = 0x1p-35;

void put_gps_ellipse(Bits& bits, const gnss::KeplerEphemeris& e) {
  put_ellipse(bits, e, e.id.system == gnss::System::QZSS ? kSemiMajorAxisOfQzss_m : kSemiMajorAxis_m);
}
void put_gps_plane(Bits& bits, const gnss::KeplerEphemeris& e) {
  put_plane(bits, e, e.right_ascension_rate - kRightAscensionRate, 17);
}
void put_gps_clock(Bits& bits, const gnss::KeplerEphemeris& e) {
  bits.number(e.af0, 0x1p-35, 26);
  bits.number(e.af1, 0x1p-48, 20);
  bits.number(e.af2, 0x1p-60, 10);
}
void put_corrections(Bits& bits, double group_delay_s, std::initializer_list<double> delays_s) {
  for (const double delay_s : delays_s) bits.number(group_delay_s - delay_s, kGpsDelayStep_s, 13);
}

}  // namespace

Bits cnav_message(const gnss::KeplerEphemeris& ephemeris, const SystemMessage& message,
                  const CnavDelays& delays, int type, GpsTime start, int length_s) {
  const gnss::KeplerEphemeris e =
      referred_to(ephemeris, whole_300_s(ephemeris.toe), whole_300_s(ephemeris.toc), kEarthGm);
  Bits bits;
  // 30.3.3: the time of week is that of the next message.
  constexpr std::int64_t kCountsPerWeek = 100'800;
  const std::int64_t count = (start.nanosecond_of_week() / GpsTime::kNanosecondsPerSecond + length_s) / 6;
  bits.put(0b10001011, 8).put(e.id.number, 6);
  bits.count(type, 6);
  bits.count(count % kCountsPerWeek, 17).put(0, 1);
  const auto clock = [&] {
    put_reference_time(bits, e.toc);
    bits.count(accuracy_index(e.accuracy_m), 5);
    bits.put(0, 3).put(0, 3);
    put_reference_time(bits, e.toc);
    put_gps_clock(bits, e);
  };
  switch (type) {
    case 10:
      bits.count(start.week(), 13);
      bits.count(e.health == 0 ? 0 : 7, 3);
      put_reference_time(bits, e.toe);
      bits.count(accuracy_index(e.accuracy_m), 5);
      put_reference_time(bits, e.toe);
      put_gps_ellipse(bits, e);
      bits.put(0, 1 + 1 + 3);  // integrity status, phasing of L2C, reserved
      break;
    case 11:
      put_reference_time(bits, e.toe);
      put_gps_plane(bits, e);
      bits.put(0, 7);
      break;
    case 30:
      clock();
      bits.number(delays.group_delay_s, kGpsDelayStep_s, 13);
      put_corrections(bits, delays.group_delay_s, {delays.l1ca_s, delays.l2c_s, delays.l5_s, delays.l5_s});
      put_klobuchar(bits, message.klobuchar);
      bits.count(start.week() & 255, 8);
      bits.put(0, 12);
      break;
    default:  // 33
      clock();
      put_utc(bits, message.leap_seconds, start.week(), 7, 4);
      bits.put(0, 51);
      break;
  }
  return bits.put(crc24q(bits), 24);
}

Bits cnav2_subframe2(const gnss::KeplerEphemeris& ephemeris, const CnavDelays& delays, GpsTime start) {
  // IS-GPS-800, 3.5.3: toe is the time of the clock too.
  const GpsTime toe = whole_300_s(ephemeris.toe);
  const gnss::KeplerEphemeris e = referred_to(ephemeris, toe, toe, kEarthGm);
  constexpr std::int64_t kInterval = 7200 * GpsTime::kNanosecondsPerSecond;
  Bits bits;
  bits.count(start.week(), 13).count(start.nanosecond_of_week() / kInterval, 8);
  put_reference_time(bits, e.toe);
  bits.put(e.health != 0, 1).count(accuracy_index(e.accuracy_m), 5);
  put_reference_time(bits, e.toe);
  put_gps_ellipse(bits, e);
  put_gps_plane(bits, e);
  bits.put(0, 5 + 3 + 3);  // accuracy of the clock
  put_gps_clock(bits, e);
  bits.number(delays.group_delay_s, kGpsDelayStep_s, 13);
  put_corrections(bits, delays.group_delay_s, {delays.l1c_s, delays.l1c_s});
  bits.put(0, 1);  // integrity status
  bits.count(start.week(), 8).put(0, 2);
  return bits.put(crc24q(bits), 24);
}

Bits cnav2_subframe3(const gnss::KeplerEphemeris& e, const SystemMessage& message, const CnavDelays& delays,
                     GpsTime start) {
  Bits bits;
  bits.count(e.id.number + (e.id.system == gnss::System::QZSS ? 192 : 0), 8).count(1, 6);
  put_utc(bits, message.leap_seconds, start.week(), 7, 4);
  put_klobuchar(bits, message.klobuchar);
  put_corrections(bits, delays.group_delay_s, {delays.l1ca_s, delays.l2c_s, delays.l5_s, delays.l5_s});
  bits.put(0, 22);
  return bits.put(crc24q(bits), 24);
}

using geodesy::GpsTime;

GpsTime whole_300_s(GpsTime t) {
  constexpr double kStep_s = 300, kLast_s = GpsTime::kSecondsPerWeek - kStep_s;
  const double second = t.seconds_of_week();
  return t + (std::min(std::round(second / kStep_s) * kStep_s, kLast_s) - second);
}

gnss::KeplerEphemeris referred_to(gnss::KeplerEphemeris e, GpsTime toe, GpsTime toc, double earth_gm) {
  const double orbit_s = toe - e.toe, clock_s = toc - e.toc;
  const double axis_m = e.sqrt_a * e.sqrt_a;
  e.mean_anomaly += (std::sqrt(earth_gm / axis_m) / axis_m + e.mean_motion_difference) * orbit_s;
  e.right_ascension += e.right_ascension_rate * orbit_s;
  e.inclination += e.inclination_rate * orbit_s;
  e.toe = toe;
  e.af0 += (e.af1 + e.af2 * clock_s) * clock_s;
  e.af1 += 2 * e.af2 * clock_s;
  e.toc = toc;
  return e;
}

void put_reference_time(Bits& bits, GpsTime t) {
  bits.positive(t.seconds_of_week(), 300, 11);
}

void put_ellipse(Bits& bits, const gnss::KeplerEphemeris& e, double reference_m) {
  bits.number(e.sqrt_a * e.sqrt_a - reference_m, 0x1p-9, 26);
  bits.put(0, 25);
  bits.angle(e.mean_motion_difference, 0x1p-44, 17);
  bits.put(0, 23);
  bits.angle(e.mean_anomaly, 0x1p-32, 33);
  bits.positive(e.eccentricity, 0x1p-34, 33);
  bits.angle(e.argument_of_perigee, 0x1p-32, 33);
}

void put_plane(Bits& bits, const gnss::KeplerEphemeris& e, double node_rate, int node_rate_bits) {
  bits.angle(e.right_ascension, 0x1p-32, 33);
  bits.angle(e.inclination, 0x1p-32, 33);
  bits.angle(node_rate, 0x1p-44, node_rate_bits);
  bits.angle(e.inclination_rate, 0x1p-44, 15);
  bits.number(e.cis, 0x1p-30, 16);
  bits.number(e.cic, 0x1p-30, 16);
  bits.number(e.crs, 0x1p-8, 24);
  bits.number(e.crc, 0x1p-8, 24);
  bits.number(e.cus, 0x1p-30, 21);
  bits.number(e.cuc, 0x1p-30, 21);
}

void put_utc(Bits& bits, int leap_seconds, int week, int day, int day_bits) {
  bits.put(0, 16 + 13 + 7);
  bits.count(leap_seconds, 8);
  bits.put(0, 16);
  bits.count(week, 13);
  bits.count(week, 13);
  bits.count(day, day_bits);
  bits.count(leap_seconds, 8);
}

}  // namespace canyon::broadcast
