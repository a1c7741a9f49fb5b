#include <cmath>

#include "canyon/broadcast/accuracy_index.hpp"
#include "canyon/broadcast/messages.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::broadcast {
namespace {

using geodesy::GpsTime;

/// What fields are differences to (IS-GPS-200 tables 30-I and 30-II; IS-QZSS-PNT-005 table 4.3.2-16).
constexpr double kSemiMajorAxis_m = 26'559'710, kSemiMajorAxisOfQzss_m = 42'164'200;
constexpr double kRightAscensionRate = -2.6e-9 * geodesy::kPi;
constexpr double kEarthGm = 3.986005e14;  ///< of GPS, 20.3.3.4.3

/// toe and toc in whole steps of 300 s, with the elements and the clock of that time.
gnss::KeplerEphemeris in_steps(gnss::KeplerEphemeris e) {
  const auto to_step = [](GpsTime t) {
    return std::round(t.seconds_of_week() / 300) * 300 - t.seconds_of_week();
  };
  const double orbit_s = to_step(e.toe), clock_s = to_step(e.toc);
  const double axis_m = e.sqrt_a * e.sqrt_a;
  e.mean_anomaly += (std::sqrt(kEarthGm / axis_m) / axis_m + e.mean_motion_difference) * orbit_s;
  e.right_ascension += e.right_ascension_rate * orbit_s;
  e.inclination += e.inclination_rate * orbit_s;
  e.toe = e.toe + orbit_s;
  e.af0 += (e.af1 + e.af2 * clock_s) * clock_s;
  e.af1 += 2 * e.af2 * clock_s;
  e.toc = e.toc + clock_s;
  return e;
}

}  // namespace

Bits cnav_message(const gnss::KeplerEphemeris& ephemeris, const SystemMessage& message,
                  const CnavDelays& delays, int type, GpsTime start, int length_s) {
  const gnss::KeplerEphemeris e = in_steps(ephemeris);
  Bits bits;
  const auto steps = [&](GpsTime t) { bits.positive(t.seconds_of_week(), 300, 11); };
  // 30.3.3: the time of week is that of the next message.
  constexpr std::int64_t kCountsPerWeek = 100'800;
  const std::int64_t count = (start.nanosecond_of_week() / GpsTime::kNanosecondsPerSecond + length_s) / 6;
  bits.put(0b10001011, 8).put(e.id.number, 6);
  bits.count(type, 6);
  bits.count(count % kCountsPerWeek, 17).put(0, 1);
  const auto clock = [&] {
    steps(e.toc);
    bits.count(accuracy_index(e.accuracy_m), 5);
    bits.put(0, 3).put(0, 3);
    steps(e.toc);
    bits.number(e.af0, 0x1p-35, 26);
    bits.number(e.af1, 0x1p-48, 20);
    bits.number(e.af2, 0x1p-60, 10);
  };
  switch (type) {
    case 10:
      bits.count(start.week(), 13);
      bits.count(e.health == 0 ? 0 : 7, 3);
      steps(e.toe);
      bits.count(accuracy_index(e.accuracy_m), 5);
      steps(e.toe);
      bits.number(e.sqrt_a * e.sqrt_a -
                      (e.id.system == gnss::System::QZSS ? kSemiMajorAxisOfQzss_m : kSemiMajorAxis_m),
                  0x1p-9, 26);
      bits.put(0, 25);
      bits.angle(e.mean_motion_difference, 0x1p-44, 17);
      bits.put(0, 23);
      bits.angle(e.mean_anomaly, 0x1p-32, 33);
      bits.positive(e.eccentricity, 0x1p-34, 33);
      bits.angle(e.argument_of_perigee, 0x1p-32, 33);
      bits.put(0, 1 + 1 + 3);  // integrity status, phasing of L2C, reserved
      break;
    case 11:
      steps(e.toe);
      bits.angle(e.right_ascension, 0x1p-32, 33);
      bits.angle(e.inclination, 0x1p-32, 33);
      bits.angle(e.right_ascension_rate - kRightAscensionRate, 0x1p-44, 17);
      bits.angle(e.inclination_rate, 0x1p-44, 15);
      bits.number(e.cis, 0x1p-30, 16);
      bits.number(e.cic, 0x1p-30, 16);
      bits.number(e.crs, 0x1p-8, 24);
      bits.number(e.crc, 0x1p-8, 24);
      bits.number(e.cus, 0x1p-30, 21);
      bits.number(e.cuc, 0x1p-30, 21);
      bits.put(0, 7);
      break;
    case 30:
      clock();
      bits.number(delays.group_delay_s, 0x1p-35, 13);
      for (const double delay : {delays.l1ca_s, delays.l2c_s, delays.l5_s, delays.l5_s}) {
        bits.number(delays.group_delay_s - delay, 0x1p-35, 13);
      }
      put_klobuchar(bits, message.klobuchar);
      bits.count(start.week() & 255, 8);
      bits.put(0, 12);
      break;
    default: {  // 33: UTC is GPST less whole seconds, no leap second announced
      clock();
      bits.put(0, 16 + 13 + 7);
      bits.count(message.leap_seconds, 8);
      bits.put(0, 16);
      bits.count(start.week(), 13);
      bits.count(start.week(), 13);
      bits.count(7, 4);
      bits.count(message.leap_seconds, 8);
      bits.put(0, 51);
      break;
    }
  }
  return bits.put(crc24q(bits), 24);
}

}  // namespace canyon::broadcast
