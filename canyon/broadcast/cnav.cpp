#include "canyon/broadcast/accuracy_index.hpp"
#include "canyon/broadcast/cnav_fields.hpp"
#include "canyon/broadcast/messages.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::broadcast {
namespace {

using geodesy::GpsTime;

/// What fields are differences to (IS-GPS-200 tables 30-I and 30-II; IS-QZSS-PNT-005 table 4.3.2-16).
constexpr double kSemiMajorAxis_m = 26'559'710, kSemiMajorAxisOfQzss_m = 42'164'200;
constexpr double kRightAscensionRate = -2.6e-9 * geodesy::kPi;
constexpr double kEarthGm = 3.986005e14;  ///< of GPS, 20.3.3.4.3

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
    bits.number(e.af0, 0x1p-35, 26);
    bits.number(e.af1, 0x1p-48, 20);
    bits.number(e.af2, 0x1p-60, 10);
  };
  switch (type) {
    case 10:
      bits.count(start.week(), 13);
      bits.count(e.health == 0 ? 0 : 7, 3);
      put_reference_time(bits, e.toe);
      bits.count(accuracy_index(e.accuracy_m), 5);
      put_reference_time(bits, e.toe);
      put_ellipse(bits, e, e.id.system == gnss::System::QZSS ? kSemiMajorAxisOfQzss_m : kSemiMajorAxis_m);
      bits.put(0, 1 + 1 + 3);  // integrity status, phasing of L2C, reserved
      break;
    case 11:
      put_reference_time(bits, e.toe);
      put_plane(bits, e, e.right_ascension_rate - kRightAscensionRate, 17);
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
    default:  // 33
      clock();
      put_utc(bits, message.leap_seconds, start.week(), 7, 4);
      bits.put(0, 51);
      break;
  }
  return bits.put(crc24q(bits), 24);
}

}  // namespace canyon::broadcast
