#include <array>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/sky/broadcast/bits.hpp"
#include "canyon/sky/broadcast/messages.hpp"

namespace canyon::broadcast {
namespace {

using geodesy::GpsTime;

std::int64_t second_of_week(GpsTime start) {
  return bdt(start).nanosecond_of_week() / GpsTime::kNanosecondsPerSecond;
}

/// Ten words: preamble, subframe, second of the week, then `content`; the rest is empty.
std::vector<std::uint32_t> coded(const Bits& content, int subframe, GpsTime start) {
  Bits bits;
  bits.put(0b11100010010, 11).put(0, 4).count(subframe, 3).count(second_of_week(start), 20);
  bits.append(content);
  constexpr std::size_t kSize = 26 + 9 * 22;
  while (bits.size() < kSize) bits.put(0, 1);
  std::vector<std::uint32_t> words;
  const auto head = static_cast<std::uint32_t>(bits.number(0, 26));
  words.push_back(head << 4 | bch_15_11(head & 0x7FF));  // its first 15 bits are not coded
  for (std::size_t i = 0; i < 9; ++i) {
    const auto information = static_cast<std::uint32_t>(bits.number(26 + 22 * i, 22));
    words.push_back(information << 8 | bch_15_11(information >> 11) << 4 | bch_15_11(information & 0x7FF));
  }
  return words;
}

/// Clock parameters' issue, health, accuracy, week, toc and delays: the start of D1 and D2.
void put_beidou_head(Bits& bits, const gnss::KeplerEphemeris& e, GpsTime start) {
  bits.put(e.health != 0, 1).count(e.iodc, 5);
  bits.count(accuracy_index(e.accuracy_m), 4).count(bdt_week(start), 13);
  bits.positive(bdt(e.toc).seconds_of_week(), 8, 17);
  bits.number(e.group_delay[0], 1e-10, 10).number(e.group_delay[1], 1e-10, 10);
}
void put_harmonic(Bits& bits, double rad) {
  bits.number(rad, 0x1p-31, 18);
}
void put_radius(Bits& bits, double metres) {
  bits.number(metres, 0x1p-6, 18);
}
/// The fields of D2 from the clock on; its pages cut them at any bit.
Bits d2_fields(const gnss::KeplerEphemeris& e) {
  Bits bits;
  bits.number(e.af0, 0x1p-33, 24).number(e.af1, 0x1p-50, 22).number(e.af2, 0x1p-66, 11).count(e.iode, 5);
  bits.angle(e.mean_motion_difference, 0x1p-43, 16);
  put_harmonic(bits, e.cuc);
  bits.angle(e.mean_anomaly, 0x1p-31, 32);
  put_harmonic(bits, e.cus);
  bits.positive(e.eccentricity, 0x1p-33, 32).positive(e.sqrt_a, 0x1p-19, 32);
  put_harmonic(bits, e.cic);
  put_harmonic(bits, e.cis);
  bits.positive(bdt(e.toe).seconds_of_week(), 8, 17).angle(e.inclination, 0x1p-31, 32);
  put_radius(bits, e.crc);
  put_radius(bits, e.crs);
  bits.angle(e.right_ascension_rate, 0x1p-43, 24).angle(e.right_ascension, 0x1p-31, 32);
  return bits.angle(e.argument_of_perigee, 0x1p-31, 32).angle(e.inclination_rate, 0x1p-43, 14);
}

constexpr double kDelayStep_s = 0x1p-34;

/// Elements and clock at the nearest whole 300 s of BDT, times in BDT.
gnss::KeplerEphemeris in_bdt(gnss::KeplerEphemeris e) {
  e.toe = bdt(e.toe);
  e.toc = bdt(e.toc);
  return referred_to(e, whole_300_s(e.toe), whole_300_s(e.toc), geodesy::kEarthMu);
}

/// IODE, 0 to 59 for data younger than 12 h, and IODC, which ends with the IODE (7.4). D1 and D2 have ages
/// instead, which successive ephemerides share: half hours of toe distinguish them.
std::int64_t issue_of_data(const gnss::KeplerEphemeris& e) {
  return std::llround(e.toe.seconds_of_week() / 1800) % 60;
}

/// 203 bits (7.7). @param e from in_bdt(), not of a geostationary satellite: these do not send B-CNAV
void put_ephemeris_1(Bits& bits, const gnss::KeplerEphemeris& e) {
  constexpr double kMeo_m = 27'906'100, kInclined_m = 42'162'200;
  const bool meo = e.sqrt_a * e.sqrt_a < 35e6;
  put_reference_time(bits, e.toe);
  bits.count(meo ? 3 : 2, 2);
  put_ellipse(bits, e, meo ? kMeo_m : kInclined_m);
}
/// 222 bits.
void put_ephemeris_2(Bits& bits, const gnss::KeplerEphemeris& e) {
  put_plane(bits, e, e.right_ascension_rate, 19);
}
/// 69 bits (7.5). @param e from in_bdt()
void put_clock(Bits& bits, const gnss::KeplerEphemeris& e) {
  put_reference_time(bits, e.toc);
  bits.number(e.af0, 0x1p-34, 25);
  bits.number(e.af1, 0x1p-50, 22);
  bits.number(e.af2, 0x1p-66, 11);
}
/// UTC relative to BDT, 97 bits.
void put_utc(Bits& bits, const SystemMessage& message, GpsTime start) {
  put_utc(bits, message.leap_seconds - geodesy::kBdtSecondsOffset, bdt_week(start), 6, 3);
}

// Unknown fields are zero: integrity flags and SISMAI (no fault), SISAI, the ionosphere of BDGIM.
constexpr int kIntegrityBits = 3 + 4, kAccuracyBits = 22;
void put_ionosphere(Bits& bits) {
  bits.put(0, 10).put(0, 64);  // nine coefficients
}

}  // namespace

std::uint32_t bch_15_11(std::uint32_t information) {
  std::uint32_t remainder = information << 4;
  for (int i = 14; i >= 4; --i)
    if ((remainder >> i & 1) != 0) remainder ^= 0b10011u << (i - 4);
  return remainder;
}

std::vector<std::uint32_t> spare_beidou_subframe(int subframe, GpsTime start) {
  return coded({}, subframe, start);
}

std::vector<std::uint32_t> d1_subframe(const gnss::KeplerEphemeris& e, const SystemMessage& message,
                                       int subframe, GpsTime start) {
  const std::int64_t toe = field_value(bdt(e.toe).seconds_of_week(), 8, 17, false);
  Bits bits;
  if (subframe == 1) {
    put_beidou_head(bits, e, start);
    put_klobuchar(bits, message.klobuchar);
    bits.number(e.af2, 0x1p-66, 11).number(e.af0, 0x1p-33, 24).number(e.af1, 0x1p-50, 22).count(e.iode, 5);
  } else if (subframe == 2) {
    bits.angle(e.mean_motion_difference, 0x1p-43, 16);
    put_harmonic(bits, e.cuc);
    bits.angle(e.mean_anomaly, 0x1p-31, 32).positive(e.eccentricity, 0x1p-33, 32);
    put_harmonic(bits, e.cus);
    put_radius(bits, e.crc);
    put_radius(bits, e.crs);
    bits.positive(e.sqrt_a, 0x1p-19, 32).count(toe >> 15, 2);
  } else {
    bits.count(toe, 15).angle(e.inclination, 0x1p-31, 32);
    put_harmonic(bits, e.cic);
    bits.angle(e.right_ascension_rate, 0x1p-43, 24);
    put_harmonic(bits, e.cis);
    bits.angle(e.inclination_rate, 0x1p-43, 14).angle(e.right_ascension, 0x1p-31, 32);
    bits.angle(e.argument_of_perigee, 0x1p-31, 32);
  }
  return coded(bits, subframe, start);
}

std::vector<std::uint32_t> d2_page(const gnss::KeplerEphemeris& e, const SystemMessage& message, int page,
                                   GpsTime start) {
  Bits bits;
  bits.count(page, 4);
  if (page == 1) {
    put_beidou_head(bits, e, start);
  } else if (page == 2) {
    put_klobuchar(bits, message.klobuchar);
  } else {
    if (page == 3) bits.put(0, 38);
    // First field bits of the pages from 3 on.
    constexpr std::array<std::size_t, 9> kFirst{0, 28, 92, 156, 220, 284, 350, 414, 433};
    const Bits fields = d2_fields(e);
    for (std::size_t i = kFirst.at(static_cast<std::size_t>(page) - 3);
         i < kFirst.at(static_cast<std::size_t>(page) - 2); ++i)
      bits.put(fields[i] ? 1 : 0, 1);
  }
  return coded(bits, 1, start);
}

Bits bcnav1_subframe2(const gnss::KeplerEphemeris& ephemeris, const BcnavDelays& delays, GpsTime start) {
  const gnss::KeplerEphemeris e = in_bdt(ephemeris);
  Bits bits;
  bits.count(bdt_week(start), 13).count(second_of_week(start) / 3600, 8);
  bits.count(issue_of_data(e), 10).count(issue_of_data(e), 8);
  put_ephemeris_1(bits, e);
  put_ephemeris_2(bits, e);
  put_clock(bits, e);
  bits.number(delays.b2a_s, kDelayStep_s, 12);
  bits.put(0, 12);  // from the pilot of B1C to its data
  bits.number(delays.b1c_s, kDelayStep_s, 12);
  bits.put(0, 7);
  return bits.put(crc24q(bits), 24);
}

Bits bcnav1_subframe3(const gnss::KeplerEphemeris& ephemeris, const SystemMessage& message, GpsTime start) {
  Bits bits;
  bits.count(1, 6).count(ephemeris.health != 0, 2).put(0, kIntegrityBits);
  bits.put(0, 5 + kAccuracyBits);
  put_ionosphere(bits);
  put_utc(bits, message, start);
  bits.put(0, 27);
  return bits.put(crc24q(bits), 24);
}

Bits bcnav2_message(const gnss::KeplerEphemeris& ephemeris, const SystemMessage& message,
                    const BcnavDelays& delays, int type, GpsTime start) {
  const gnss::KeplerEphemeris e = in_bdt(ephemeris);
  Bits bits;
  bits.count(e.id.number, 6).count(type, 6).count(second_of_week(start) / 3, 18);
  if (type == 10)
    bits.count(bdt_week(start), 13);
  else
    bits.count(e.health != 0, 2);
  bits.put(0, kIntegrityBits).put(0, 3);  // of B2a, of B1C
  switch (type) {
    case 10:
      bits.count(issue_of_data(e), 8);
      put_ephemeris_1(bits, e);
      break;
    case 11:
      put_ephemeris_2(bits, e);
      break;
    case 30:
      put_clock(bits, e);
      bits.count(issue_of_data(e), 10);
      bits.number(delays.b2a_s, kDelayStep_s, 12);
      bits.put(0, 12);  // from the pilot of B2a to its data
      put_ionosphere(bits);
      bits.number(delays.b1c_s, kDelayStep_s, 12);
      bits.put(0, 33);
      break;
    default:  // 34
      bits.put(0, kAccuracyBits);
      put_clock(bits, e);
      bits.count(issue_of_data(e), 10);
      put_utc(bits, message, start);
      bits.put(0, 24);
      break;
  }
  return bits.put(crc24q(bits), 24);
}

Bits bcnav3_message(const gnss::KeplerEphemeris& ephemeris, const SystemMessage& message,
                    const BcnavDelays& delays, int type, GpsTime start) {
  const gnss::KeplerEphemeris e = in_bdt(ephemeris);
  Bits bits;
  bits.count(type, 6).count(second_of_week(start), 20);
  if (type == 10) {
    bits.put(0, 4);
    put_ephemeris_1(bits, e);
    put_ephemeris_2(bits, e);
    bits.put(0, kIntegrityBits);
  } else {
    bits.count(bdt_week(start), 13).put(0, 4);
    put_clock(bits, e);
    bits.number(delays.b2b_s, kDelayStep_s, 12);
    put_ionosphere(bits);
    put_utc(bits, message, start);
    bits.put(0, 64).put(0, 64).put(0, 10);  // Earth orientation
    bits.put(0, kAccuracyBits + 5);
    bits.count(e.health != 0, 2);
  }
  return bits.put(crc24q(bits), 24);
}

}  // namespace canyon::broadcast
