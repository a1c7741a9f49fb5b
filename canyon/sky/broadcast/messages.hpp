#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/sky/broadcast/bits.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::broadcast {

// The bits of navigation messages, from the records of navigation files. Values are rounded to the steps of
// their fields (two's complement unless noted): records from a real broadcast are restored exactly; a nominal
// sky's exact orbit changes by up to some centimetres (GLONASS: decimetres), see messages_test.cpp.
/// Ionosphere and UTC in the messages of a system's satellites.
struct SystemMessage {
  gnss::Klobuchar klobuchar;        ///< GPS, QZSS, BeiDou
  std::array<double, 3> nequick{};  ///< Galileo
  int leap_seconds = 18;            ///< GPST minus UTC
};

/// Eight coefficients of 8 bits each, equal in LNAV, D1 and D2.
void put_klobuchar(Bits& bits, const gnss::Klobuchar& k);

/// Subframe 1, 2 or 3 of GPS LNAV (IS-GPS-200 20.3.3.3, 20.3.3.4), also QZSS's: ten words of 30 bits, parity
/// in the low six. Data bits are as in the ICD, not inverted by the preceding word, as receivers output them.
/// @param start of the subframe, a multiple of 6 s of the GPS week
[[nodiscard]] std::vector<std::uint32_t> lnav_subframe(const gnss::KeplerEphemeris& ephemeris, int subframe,
                                                       geodesy::GpsTime start);
/// Page 18 of subframe 4: ionosphere and UTC (20.3.3.5.1.6 and 7).
[[nodiscard]] std::vector<std::uint32_t> lnav_page18(gnss::System system, const SystemMessage& message,
                                                     geodesy::GpsTime start);
/// The six parity bits of a word (IS-GPS-200 table 20-XIV).
/// @param data 24 bits; @param d29, d30 the last two bits of the preceding word
[[nodiscard]] std::uint32_t lnav_parity(std::uint32_t data, bool d29, bool d30);

/// Word of Galileo I/NAV (OS SIS ICD 2.1, 4.3.5): 128 bits. Types 0 (spare, with time), 1 to 4 (ephemeris), 5
/// (ionosphere, BGD, health, time) and 6 (UTC).
/// @param start of the word's page
[[nodiscard]] Bits inav_word(const gnss::KeplerEphemeris& ephemeris, const SystemMessage& message, int type,
                             geodesy::GpsTime start);
/// Its nominal page on E1-B (search and rescue bits zero) and on E5b-I (4.3.2.3): the even part and
/// the odd part with CRC-24Q and tail bits, 120 bits each, in four words of 32 bits each.
[[nodiscard]] std::vector<std::uint32_t> inav_page(const Bits& word);

/// Page 1 to 6 of Galileo F/NAV (OS SIS ICD 2.1, 4.2.4): 244 bits with CRC-24Q and tail bits. 5 and 6 have
/// almanacs of no satellite. @param ephemeris from I/NAV or F/NAV @param start of the page
[[nodiscard]] Bits fnav_page(const gnss::KeplerEphemeris& ephemeris, const SystemMessage& message, int type,
                             geodesy::GpsTime start);

/// Delays of signals relative to the broadcast clock, and TGD [s].
struct CnavDelays {
  double group_delay_s = 0, l1ca_s = 0, l2c_s = 0, l5_s = 0, l1c_s = 0;
};
/// Message 10 or 11 (ephemeris), 30 (clock, delays, ionosphere) or 33 (clock, UTC) of CNAV of GPS (IS-GPS-200
/// 30.3.3) and QZSS (IS-QZSS-PNT-005 4.3.2, with another reference axis): 300 bits with CRC-24Q. Elements and
/// clock refer to the nearest whole 300 s.
/// @param start of the message @param length_s 12 on L2C, 6 on L5
[[nodiscard]] Bits cnav_message(const gnss::KeplerEphemeris& ephemeris, const SystemMessage& message,
                                const CnavDelays& delays, int type, geodesy::GpsTime start, int length_s);

/// Subframe 2 of CNAV-2 of GPS (IS-GPS-800, 3.5.3) and QZSS: time, ephemeris, clock, delays; 600 bits with
/// CRC-24Q. Elements and clock refer to the nearest whole 300 s to toe. @param start of the frame
[[nodiscard]] Bits cnav2_subframe2(const gnss::KeplerEphemeris& ephemeris, const CnavDelays& delays,
                                   geodesy::GpsTime start);
/// Page 1 of its subframe 3: UTC, ionosphere, delays; 274 bits with CRC-24Q.
[[nodiscard]] Bits cnav2_subframe3(const gnss::KeplerEphemeris& ephemeris, const SystemMessage& message,
                                   const CnavDelays& delays, geodesy::GpsTime start);

/// BeiDou time and its weeks (BDS-SIS-ICD-B1I-3.0, 3.3).
[[nodiscard]] inline geodesy::GpsTime bdt(geodesy::GpsTime t) {
  return t - std::chrono::seconds(geodesy::kBdtSecondsOffset);
}
[[nodiscard]] inline int bdt_week(geodesy::GpsTime t) {
  return bdt(t).week() - geodesy::kBdtWeekOffset;
}
/// Subframe 1, 2 or 3 of BeiDou D1 (BDS-SIS-ICD-B1I-3.0, 5.2.4): ten words of 30 bits with BCH(15,11,1), as
/// receivers output them: 22 bits, the parity of the first 11 and that of the other 11; in the first word 26
/// bits and the parity of the last 11.
/// @param start of the subframe, a multiple of 6 s of the BDT week
[[nodiscard]] std::vector<std::uint32_t> d1_subframe(const gnss::KeplerEphemeris& ephemeris,
                                                     const SystemMessage& message, int subframe,
                                                     geodesy::GpsTime start);
/// Page 1 to 10 of subframe 1 of D2, of geostationary satellites (5.3.2): ten words, the last five empty.
/// @param start of the subframe, a multiple of 3 s of the BDT week
[[nodiscard]] std::vector<std::uint32_t> d2_page(const gnss::KeplerEphemeris& ephemeris,
                                                 const SystemMessage& message, int page,
                                                 geodesy::GpsTime start);
/// A subframe of D1 or D2 with unknown content: preamble, number and second of the week, then zeros.
/// @param start of the subframe, of D2 of its frame
[[nodiscard]] std::vector<std::uint32_t> spare_beidou_subframe(int subframe, geodesy::GpsTime start);
/// Four parity bits of 11 bits, generator x^4 + x + 1 (5.1.3).
[[nodiscard]] std::uint32_t bch_15_11(std::uint32_t information);

/// Delays of signals relative to the broadcast clock [s]: pilots of B1C and B2a, B2b.
struct BcnavDelays {
  double b1c_s = 0, b2a_s = 0, b2b_s = 0;
};
/// Subframe 2 of B-CNAV1 (BDS-SIS-ICD-B1C-1.0, 6.2.3): time, ephemeris, clock, delays; 600 bits with CRC-24Q.
/// Elements and clock refer to the nearest whole 300 s. @param start of the frame
[[nodiscard]] Bits bcnav1_subframe2(const gnss::KeplerEphemeris& ephemeris, const BcnavDelays& delays,
                                    geodesy::GpsTime start);
/// Page 1 of its subframe 3: health, UTC, an ionosphere (BDGIM) of zeros; 264 bits with CRC-24Q.
[[nodiscard]] Bits bcnav1_subframe3(const gnss::KeplerEphemeris& ephemeris, const SystemMessage& message,
                                    geodesy::GpsTime start);

/// Message 10 or 11 (ephemeris), 30 (clock, delays) or 34 (clock, UTC) of B-CNAV2
/// (BDS-SIS-ICD-B2a-1.0, 6.2.3): 288 bits with CRC-24Q. Ionosphere and reference time as in B-CNAV1.
/// @param start of the message
[[nodiscard]] Bits bcnav2_message(const gnss::KeplerEphemeris& ephemeris, const SystemMessage& message,
                                  const BcnavDelays& delays, int type, geodesy::GpsTime start);

/// Message 10 (ephemeris) or 30 (week, clock, delay, UTC) of B-CNAV3 (BDS-SIS-ICD-B2b-1.0, 6.2.3): 486 bits
/// with CRC-24Q, likewise, and Earth orientation of zeros. @param start of the message
[[nodiscard]] Bits bcnav3_message(const gnss::KeplerEphemeris& ephemeris, const SystemMessage& message,
                                  const BcnavDelays& delays, int type, geodesy::GpsTime start);

/// String 1 to 15 of GLONASS (ICD L1, L2 5.1, 4.3 to 4.5): bits 85 to 1 with the Hamming code; signed fields
/// are sign and magnitude. Strings from 6 on (almanacs) are empty.
/// @param start of the frame, a multiple of 30 s of the GLONASS day
[[nodiscard]] Bits glonass_string(const gnss::GlonassEphemeris& ephemeris, int string,
                                  geodesy::GpsTime start);

/// Message 9 of SBAS (orbit and clock of its satellite), or 0 (not for safety of life) or 63 (null), which
/// are empty (RTCA DO-229, A.4.4): 250 bits with CRC-24Q. The accuracy has GPS's index. @param start a whole
/// second
[[nodiscard]] Bits sbas_message(const gnss::SbasEphemeris& ephemeris, int type, geodesy::GpsTime start);

// Fields that are equal in CNAV (IS-GPS-200 30.3.3), CNAV-2 (IS-GPS-800 3.5) and B-CNAV (BDS-SIS-ICD-B1C-1.0,
// 7).
/// The nearest whole 300 s in the week of `t`.
[[nodiscard]] geodesy::GpsTime whole_300_s(geodesy::GpsTime t);
/// The same orbit and clock, with elements at `toe` and the polynomial at `toc`.
/// @param toe in the week of the ephemeris' toe @param earth_gm of the system [m^3/s^2]
[[nodiscard]] gnss::KeplerEphemeris referred_to(gnss::KeplerEphemeris e, geodesy::GpsTime toe,
                                                geodesy::GpsTime toc, double earth_gm);

/// A time of the week in units of 300 s: 11 bits.
void put_reference_time(Bits& bits, geodesy::GpsTime t);
/// 190 bits: semi-major axis minus a reference, its rate, mean motion difference, its rate, mean anomaly,
/// eccentricity, argument of perigee.
void put_ellipse(Bits& bits, const gnss::KeplerEphemeris& e, double reference_m);
/// 203 bits plus `node_rate` [rad/s]: node, inclination, their rates, Cis, Cic, Crs, Crc, Cus, Cuc.
void put_plane(Bits& bits, const gnss::KeplerEphemeris& e, double node_rate, int node_rate_bits);
/// UTC is the system's time minus whole seconds, no leap second announced: 94 bits plus the day of the week.
void put_utc(Bits& bits, int leap_seconds, int week, int day, int day_bits);

}  // namespace canyon::broadcast
