// Declared in canyon/broadcast/messages.hpp.
#include <array>
#include <bit>
#include <cmath>

#include "canyon/broadcast/bits.hpp"
#include "canyon/broadcast/messages.hpp"

namespace canyon::broadcast {
namespace {

using geodesy::GpsTime;

/// Ten words from what follows the handover word: 8 words of 24 bits, the last with 22, whose two free bits
/// bring the last two parity bits to zero, as in the handover word.
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
    // The free bits d23 and d24 are counted up until parity bits d29 and d30 are 0, which one of the four
    // values gives: d24 changes both, d23 changes d30 alone.
    while ((i == 1 || i == 9) && (lnav_parity(data, d29, d30) & 3) != 0) ++data;
    const std::uint32_t parity = lnav_parity(data, d29, d30);
    words.push_back(data << 6 | parity);
    d29 = (parity & 2) != 0;
    d30 = (parity & 1) != 0;
  }
  return words;
}

}  // namespace

std::uint32_t lnav_parity(std::uint32_t data, bool d29, bool d30) {
  // Rows of table 20-XIV: bit 23 is d1, and D29* or D30* of the word before.
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
  bits.put(0, 24 + 32);                                   // A1, A0: UTC is GPST less whole seconds
  bits.put(0, 8).put(week, 8);                            // t_ot, WN_t
  bits.put(leap, 8).put(week, 8).put(7, 8).put(leap, 8);  // no leap second announced
  bits.put(0, 14);
  return subframe_words(bits, 4, start);
}

}  // namespace canyon::broadcast
