// Declared in canyon/broadcast/messages.hpp.
#include <cmath>

#include "canyon/broadcast/bits.hpp"
#include "canyon/broadcast/messages.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::broadcast {
namespace {

using geodesy::GpsTime;

/// Ten words: preamble, subframe, second of the week, then what is left empty behind `content`.
std::vector<std::uint32_t> coded(const Bits& content, int subframe, GpsTime start) {
  const auto second =
      static_cast<std::uint64_t>(bdt(start).nanosecond_of_week() / GpsTime::kNanosecondsPerSecond);
  Bits bits;
  bits.put(0b11100010010, 11).put(0, 4).count(subframe, 3).put(second, 20);
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

/// The fields of an ephemeris as both messages have them.
struct Fields {
  const gnss::KeplerEphemeris& e;

  static std::uint64_t scaled(double value, double step, int width, bool is_signed = true) {
    return static_cast<std::uint64_t>(field_value(value, step, width, is_signed)) &
           ((std::uint64_t{1} << width) - 1);
  }
  static std::uint64_t power(double value, int exponent, int width, bool is_signed = true) {
    return scaled(value, std::ldexp(1.0, exponent), width, is_signed);
  }
  static std::uint64_t angle(double value, int exponent, int width) {
    return power(value / geodesy::kPi, exponent, width);
  }
  [[nodiscard]] std::uint64_t toc() const { return scaled(bdt(e.toc).seconds_of_week(), 8, 17, false); }
  [[nodiscard]] std::uint64_t toe() const { return scaled(bdt(e.toe).seconds_of_week(), 8, 17, false); }
  [[nodiscard]] std::uint64_t group_delay(std::size_t i) const { return scaled(e.group_delay[i], 1e-10, 10); }
  [[nodiscard]] std::uint64_t a0() const { return power(e.af0, -33, 24); }
  [[nodiscard]] std::uint64_t a1() const { return power(e.af1, -50, 22); }
  [[nodiscard]] std::uint64_t a2() const { return power(e.af2, -66, 11); }
  [[nodiscard]] std::uint64_t mean_motion() const { return angle(e.mean_motion_difference, -43, 16); }
  [[nodiscard]] std::uint64_t mean_anomaly() const { return angle(e.mean_anomaly, -31, 32); }
  [[nodiscard]] std::uint64_t eccentricity() const { return power(e.eccentricity, -33, 32, false); }
  [[nodiscard]] std::uint64_t sqrt_a() const { return power(e.sqrt_a, -19, 32, false); }
  [[nodiscard]] std::uint64_t node() const { return angle(e.right_ascension, -31, 32); }
  [[nodiscard]] std::uint64_t node_rate() const { return angle(e.right_ascension_rate, -43, 24); }
  [[nodiscard]] std::uint64_t inclination() const { return angle(e.inclination, -31, 32); }
  [[nodiscard]] std::uint64_t inclination_rate() const { return angle(e.inclination_rate, -43, 14); }
  [[nodiscard]] std::uint64_t perigee() const { return angle(e.argument_of_perigee, -31, 32); }
  static std::uint64_t harmonic(double value) { return power(value, -31, 18); }
  static std::uint64_t radius(double value) { return power(value, -6, 18); }
};

}  // namespace

std::uint32_t bch_15_11(std::uint32_t information) {
  std::uint32_t remainder = information << 4;
  for (int i = 14; i >= 4; --i) {
    if ((remainder >> i & 1) != 0) remainder ^= 0b10011u << (i - 4);
  }
  return remainder;
}

std::vector<std::uint32_t> spare_beidou_subframe(int subframe, GpsTime start) {
  return coded({}, subframe, start);
}

std::vector<std::uint32_t> d1_subframe(const gnss::KeplerEphemeris& e, const SystemMessage& message,
                                       int subframe, GpsTime start) {
  const Fields f{e};
  Bits bits;
  if (subframe == 1) {
    bits.put(e.health != 0, 1).count(e.iodc, 5);
    bits.count(accuracy_index(e.accuracy_m), 4).count(bdt_week(start), 13);
    bits.put(f.toc(), 17).put(f.group_delay(0), 10).put(f.group_delay(1), 10);
    put_klobuchar(bits, message.klobuchar);
    bits.put(f.a2(), 11).put(f.a0(), 24).put(f.a1(), 22).count(e.iode, 5);
  } else if (subframe == 2) {
    bits.put(f.mean_motion(), 16).put(f.harmonic(e.cuc), 18).put(f.mean_anomaly(), 32);
    bits.put(f.eccentricity(), 32).put(f.harmonic(e.cus), 18).put(f.radius(e.crc), 18);
    bits.put(f.radius(e.crs), 18).put(f.sqrt_a(), 32).put(f.toe() >> 15, 2);
  } else {
    bits.put(f.toe(), 15).put(f.inclination(), 32).put(f.harmonic(e.cic), 18).put(f.node_rate(), 24);
    bits.put(f.harmonic(e.cis), 18).put(f.inclination_rate(), 14).put(f.node(), 32).put(f.perigee(), 32);
  }
  return coded(bits, subframe, start);
}

std::vector<std::uint32_t> d2_page(const gnss::KeplerEphemeris& e, const SystemMessage& message, int page,
                                   GpsTime start) {
  const Fields f{e};
  Bits bits;
  bits.count(page, 4);
  switch (page) {
    case 1:
      bits.put(e.health != 0, 1).count(e.iodc, 5);
      bits.count(accuracy_index(e.accuracy_m), 4).count(bdt_week(start), 13);
      bits.put(f.toc(), 17).put(f.group_delay(0), 10).put(f.group_delay(1), 10);
      break;
    case 2:
      put_klobuchar(bits, message.klobuchar);
      break;
    case 3:
      bits.put(0, 38).put(f.a0(), 24).put(f.a1() >> 18, 4);
      break;
    case 4:
      bits.put(f.a1(), 18).put(f.a2(), 11).count(e.iode, 5);
      bits.put(f.mean_motion(), 16).put(f.harmonic(e.cuc) >> 4, 14);
      break;
    case 5:
      bits.put(f.harmonic(e.cuc), 4).put(f.mean_anomaly(), 32).put(f.harmonic(e.cus), 18);
      bits.put(f.eccentricity() >> 22, 10);
      break;
    case 6:
      bits.put(f.eccentricity(), 22).put(f.sqrt_a(), 32).put(f.harmonic(e.cic) >> 8, 10);
      break;
    case 7:
      bits.put(f.harmonic(e.cic), 8).put(f.harmonic(e.cis), 18).put(f.toe(), 17);
      bits.put(f.inclination() >> 11, 21);
      break;
    case 8:
      bits.put(f.inclination(), 11).put(f.radius(e.crc), 18).put(f.radius(e.crs), 18);
      bits.put(f.node_rate() >> 5, 19);
      break;
    case 9:
      bits.put(f.node_rate(), 5).put(f.node(), 32).put(f.perigee() >> 5, 27);
      break;
    default:
      bits.put(f.perigee(), 5).put(f.inclination_rate(), 14);
      break;
  }
  return coded(bits, 1, start);
}

}  // namespace canyon::broadcast
