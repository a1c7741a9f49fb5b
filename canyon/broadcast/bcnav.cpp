// Declared in canyon/broadcast/messages.hpp.
#include <cmath>

#include "canyon/broadcast/messages.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::broadcast {
namespace {

using geodesy::GpsTime;

constexpr double kDelayStep_s = 0x1p-34;

std::int64_t second_of_week(GpsTime start) {
  return bdt(start).nanosecond_of_week() / GpsTime::kNanosecondsPerSecond;
}

/// Elements and clock of the nearest whole 300 s of BDT, times in BDT.
gnss::KeplerEphemeris in_bdt(gnss::KeplerEphemeris e) {
  e.toe = bdt(e.toe);
  e.toc = bdt(e.toc);
  return referred_to(e, whole_300_s(e.toe), whole_300_s(e.toc), geodesy::kEarthMu);
}

/// IODE, 0 to 59 of data younger than 12 h, and IODC, which ends as it does (7.4). D1 and D2 have ages in
/// their place, which ephemerides that follow each other share: half hours of toe tell them apart.
std::int64_t issue_of_data(const gnss::KeplerEphemeris& e) {
  return std::llround(e.toe.seconds_of_week() / 1800) % 60;
}

/// 203 bits (7.7). @param e of in_bdt(), not of a geostationary satellite: these do not send B-CNAV
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
/// 69 bits (7.5). @param e of in_bdt()
void put_clock(Bits& bits, const gnss::KeplerEphemeris& e) {
  put_reference_time(bits, e.toc);
  bits.number(e.af0, 0x1p-34, 25);
  bits.number(e.af1, 0x1p-50, 22);
  bits.number(e.af2, 0x1p-66, 11);
}
/// UTC by BDT, 97 bits.
void put_utc(Bits& bits, const SystemMessage& message, GpsTime start) {
  put_utc(bits, message.leap_seconds - geodesy::kBdtSecondsOffset, bdt_week(start), 6, 3);
}

// Unknown fields are zero: integrity flags and SISMAI (no fault), SISAI, the ionosphere of BDGIM.
constexpr int kIntegrityBits = 3 + 4, kAccuracyBits = 22;
void put_ionosphere(Bits& bits) {
  bits.put(0, 10).put(0, 64);  // nine coefficients
}

}  // namespace

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
  if (type == 10) {
    bits.count(bdt_week(start), 13);
  } else {
    bits.count(e.health != 0, 2);
  }
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
