#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace canyon::broadcast {

/// The integer of `value` in units of `step` in a field of `width` bits: rounded to the nearest, two's
/// complement if `is_signed`, limited to the field's range; 0 for NaN.
[[nodiscard]] std::int64_t field_value(double value, double step, int width, bool is_signed);

/// Bits of a navigation message in transmission order.
class Bits {
 public:
  Bits() = default;

  /// The `width` low bits of `value`, most significant first; width 0 to 64.
  Bits& put(std::uint64_t value, int width);
  /// A whole number, in two's complement if it is negative; bits beyond `width` are cut, as messages do with
  /// weeks.
  Bits& count(std::int64_t value, int width) { return put(static_cast<std::uint64_t>(value), width); }
  /// `value` over `step` in two's complement, rounded to the nearest and limited to the field's range.
  Bits& number(double value, double step, int width) {
    return count(field_value(value, step, width, true), width);
  }
  /// The same without a sign.
  Bits& positive(double value, double step, int width) {
    return count(field_value(value, step, width, false), width);
  }
  /// An angle or its rate [rad, rad/s] in semicircles over `step`, wrapped to half a turn.
  Bits& angle(double radians, double step, int width);
  /// Sign bit, then the magnitude in `width` - 1 bits.
  Bits& sign_magnitude(double value, double step, int width);
  Bits& append(const Bits& other);

  [[nodiscard]] std::size_t size() const { return bits_.size(); }
  [[nodiscard]] bool operator[](std::size_t i) const { return bits_[i] != 0; }
  /// Bits [first, first + width) as a number; width 0 to 64. Precondition: they exist.
  [[nodiscard]] std::uint64_t number(std::size_t first, std::size_t width) const;
  /// Words of 32 bits from the first bit on, the last one filled with zeros.
  [[nodiscard]] std::vector<std::uint32_t> words32() const;

  friend bool operator==(const Bits&, const Bits&) = default;

 private:
  std::vector<std::uint8_t> bits_;  ///< 0 or 1
};

/// CRC-24Q of bits, first one first (OS SIS ICD 2.1, 5.1.9.4; RTCA DO-229 A.4.3.3): x^24 + x^23 + x^18 + x^17
/// + x^14 + x^11 + x^10 + x^7 + x^6 + x^5 + x^4 + x^3 + x + 1.
[[nodiscard]] std::uint32_t crc24q(const Bits& bits);

/// User range accuracy index, 0 to 15, of the accuracy [m] in a navigation file: the first whose nominal
/// value is at least that (IS-GPS-200 20.3.3.3.1.3: 2, 2.8, 4, 5.7, 8, 11.3, 16, 32 to 6144; also QZSS and
/// BeiDou, BDS-SIS-ICD-B1I 5.2.4.5; index 0 also 2.4). 15, no prediction, beyond.
[[nodiscard]] int accuracy_index(double accuracy_m);
/// Galileo's SISA index (OS SIS ICD 2.1, table 76); 255, no prediction, for negative values and above 6 m.
[[nodiscard]] int sisa_index(double accuracy_m);

}  // namespace canyon::broadcast
