#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <initializer_list>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/sky/broadcast/bits.hpp"
#include "canyon/sky/broadcast/messages.hpp"

namespace canyon::broadcast {
namespace {

using geodesy::GpsTime;

/// Ten words from the content after the handover word: 8 words of 24 bits, the last with 22; its two free
/// bits make the last two parity bits zero, as in the handover word.
std::vector<std::uint32_t> subframe_words(const Bits& content, int subframe, GpsTime start) {
  // Count of 6 s intervals at the start of the next subframe.
  const auto count =
      static_cast<std::uint64_t>(start.nanosecond_of_week() / (6 * GpsTime::kNanosecondsPerSecond));
  constexpr std::uint64_t kCountsPerWeek = 100'800;
  Bits bits;
  bits.put(0x8B, 8).put(0, 16);  // telemetry word: preamble, no message
  bits.put((count + 1) % kCountsPerWeek, 17).put(0, 2).count(subframe, 3).put(0, 2);
  bits.append(content).put(0, 2);
  std::vector<std::uint32_t> words;
  bool d29 = false, d30 = false;
  for (std::size_t i = 0; i < 10; ++i) {
    auto data = static_cast<std::uint32_t>(bits.number(24 * i, 24));
    // The free bits d23 and d24 are incremented until parity bits d29 and d30 are 0. One of the four values
    // does this: d24 changes both, d23 changes only d30.
    while ((i == 1 || i == 9) && (lnav_parity(data, d29, d30) & 3) != 0) ++data;
    const std::uint32_t parity = lnav_parity(data, d29, d30);
    words.push_back(data << 6 | parity);
    d29 = (parity & 2) != 0;
    d30 = (parity & 1) != 0;
  }
  return words;
}

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

std::uint32_t lnav_parity(std::uint32_t data, bool d29, bool d30) {
  // Rows of table 20-XIV: bit 23 is d1, and D29* or D30* of the preceding word.
  constexpr std::array<std::uint32_t, 6> kRows{0xEC7CD2, 0x763E69, 0xBB1F34, 0x5D8F9A, 0xAEC7CD, 0x2DEA27};
  constexpr std::array<bool, 6> kBy30{false, true, false, true, true, false};
  std::uint32_t parity = 0;
  for (std::size_t i = 0; i < kRows.size(); ++i) {
    const bool bit = (std::popcount(data & kRows[i]) % 2 != 0) != (kBy30[i] ? d30 : d29);
    parity = parity << 1 | static_cast<std::uint32_t>(bit);
  }
  return parity;
}

std::vector<std::uint32_t> lnav_subframe(const gnss::KeplerEphemeris& e, int subframe, GpsTime start) {
  Bits bits;
  if (subframe == 1) {
    bits.count(start.week(), 10);
    bits.count(e.id.system == gnss::System::GPS ? e.data_sources : 2, 2);
    bits.count(accuracy_index(e.accuracy_m), 4);
    bits.count(e.health, 6);
    bits.count(e.iodc >> 8, 2);
    bits.count(e.l2p_flag, 1);
    bits.put(0, 23).put(0, 24).put(0, 24).put(0, 16);  // reserved
    bits.number(e.group_delay[0], 0x1p-31, 8);
    bits.count(e.iodc, 8);
    bits.positive(e.toc.seconds_of_week(), 0x1p4, 16);
    bits.number(e.af2, 0x1p-55, 8);
    bits.number(e.af1, 0x1p-43, 16);
    bits.number(e.af0, 0x1p-31, 22);
  } else if (subframe == 2) {
    bits.count(e.iode, 8);
    bits.number(e.crs, 0x1p-5, 16);
    bits.angle(e.mean_motion_difference, 0x1p-43, 16);
    bits.angle(e.mean_anomaly, 0x1p-31, 32);
    bits.number(e.cuc, 0x1p-29, 16);
    bits.positive(e.eccentricity, 0x1p-33, 32);
    bits.number(e.cus, 0x1p-29, 16);
    bits.positive(e.sqrt_a, 0x1p-19, 32);
    bits.positive(e.toe.seconds_of_week(), 0x1p4, 16);
    // A flag: more than four hours; QZSS: more than two.
    const bool longer = e.fit_interval_h > (e.id.system == gnss::System::QZSS ? 2 : 4);
    bits.count(longer ? 1 : 0, 1);
    bits.count(0b11111, 5);  // AODO: no correction table
  } else {
    bits.number(e.cic, 0x1p-29, 16);
    bits.angle(e.right_ascension, 0x1p-31, 32);
    bits.number(e.cis, 0x1p-29, 16);
    bits.angle(e.inclination, 0x1p-31, 32);
    bits.number(e.crc, 0x1p-5, 16);
    bits.angle(e.argument_of_perigee, 0x1p-31, 32);
    bits.angle(e.right_ascension_rate, 0x1p-43, 24);
    bits.count(e.iode, 8);
    bits.angle(e.inclination_rate, 0x1p-43, 14);
  }
  return subframe_words(bits, subframe, start);
}

void put_klobuchar(Bits& bits, const gnss::Klobuchar& k) {
  constexpr std::array<int, 4> kAlpha{-30, -27, -24, -24}, kBeta{11, 14, 16, 16};
  for (std::size_t i = 0; i < 4; ++i) bits.number(k.alpha[i], std::ldexp(1.0, kAlpha[i]), 8);
  for (std::size_t i = 0; i < 4; ++i) bits.number(k.beta[i], std::ldexp(1.0, kBeta[i]), 8);
}

std::vector<std::uint32_t> lnav_page18(gnss::System system, const SystemMessage& message, GpsTime start) {
  Bits bits;
  bits.put(system == gnss::System::QZSS ? 3 : 1, 2).put(56, 6);
  put_klobuchar(bits, message.klobuchar);
  const auto week = static_cast<std::uint64_t>(start.week());
  const auto leap = static_cast<std::uint64_t>(message.leap_seconds);
  bits.put(0, 24 + 32);                                   // A1, A0: UTC is GPST minus whole seconds
  bits.put(0, 8).put(week, 8);                            // t_ot, WN_t
  bits.put(leap, 8).put(week, 8).put(7, 8).put(leap, 8);  // no leap second announced
  bits.put(0, 14);
  return subframe_words(bits, 4, start);
}

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
  // IS-GPS-800, 3.5.3: toe is also the reference time of the clock.
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

Bits sbas_message(const gnss::SbasEphemeris& e, int type, geodesy::GpsTime start) {
  constexpr std::array<std::uint64_t, 3> kPreambles{0x53, 0x9A, 0xC6};
  constexpr double kSecondsPerDay = 86400;
  const std::int64_t second = start.nanosecond_of_week() / geodesy::GpsTime::kNanosecondsPerSecond;
  Bits bits;
  bits.put(kPreambles[static_cast<std::size_t>(second % 3)], 8).count(type, 6);
  if (type == 9) {
    bits.count(e.iodn, 8).positive(std::fmod(e.toe.seconds_of_week(), kSecondsPerDay), 16, 13);
    bits.count(accuracy_index(e.accuracy_m), 4);
    bits.number(e.position_m[0], 0.08, 30).number(e.position_m[1], 0.08, 30).number(e.position_m[2], 0.4, 25);
    bits.number(e.velocity_mps[0], 0.000625, 17)
        .number(e.velocity_mps[1], 0.000625, 17)
        .number(e.velocity_mps[2], 0.004, 18);
    bits.number(e.acceleration_mps2[0], 0.0000125, 10)
        .number(e.acceleration_mps2[1], 0.0000125, 10)
        .number(e.acceleration_mps2[2], 0.0000625, 10);
    bits.number(e.clock_bias_s, 0x1p-31, 12).number(e.clock_drift, 0x1p-40, 8);
  } else {
    for (int part = 0; part < 4; ++part) bits.put(0, 53);
  }
  return bits.put(crc24q(bits), 24);
}

}  // namespace canyon::broadcast
