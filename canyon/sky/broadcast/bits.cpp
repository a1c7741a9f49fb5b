#include "canyon/sky/broadcast/bits.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"

namespace canyon::broadcast {

Bits& Bits::put(std::uint64_t value, int width) {
  assert(width >= 0 && width <= 64);
  for (int i = width - 1; i >= 0; --i) bits_.push_back(static_cast<std::uint8_t>(value >> i & 1));
  return *this;
}

Bits& Bits::angle(double radians, double step, int width) {
  const double steps = std::round(std::remainder(radians / geodesy::kPi, 2) / step);
  // Half a turn becomes the lowest number, because the highest is a step less.
  return number(steps == std::ldexp(1.0, width - 1) ? -steps : steps, 1, width);
}

Bits& Bits::sign_magnitude(double value, double step, int width) {
  const std::int64_t magnitude = field_value(std::abs(value), step, width - 1, false);
  return put(value < 0 && magnitude != 0, 1).count(magnitude, width - 1);
}

Bits& Bits::append(const Bits& other) {
  bits_.insert(bits_.end(), other.bits_.begin(), other.bits_.end());
  return *this;
}

std::uint64_t Bits::number(std::size_t first, std::size_t width) const {
  assert(first + width <= bits_.size() && width <= 64);
  std::uint64_t value = 0;
  for (std::size_t i = first; i < first + width; ++i) value = value << 1 | bits_[i];
  return value;
}

std::vector<std::uint32_t> Bits::words32() const {
  std::vector<std::uint32_t> words((bits_.size() + 31) / 32);
  for (std::size_t i = 0; i < bits_.size(); ++i)
    words[i / 32] |= static_cast<std::uint32_t>(bits_[i]) << (31 - i % 32);
  return words;
}

std::int64_t field_value(double value, double step, int width, bool is_signed) {
  const double steps = std::round(value / step);
  if (std::isnan(steps)) return 0;
  const double low = is_signed ? -std::ldexp(1.0, width - 1) : 0;
  const double high = std::ldexp(1.0, is_signed ? width - 1 : width) - 1;
  return static_cast<std::int64_t>(std::clamp(steps, low, high));
}

std::uint32_t crc24q(const Bits& bits) {
  constexpr std::uint32_t kPolynomial = 0x1864CFB;
  std::uint32_t crc = 0;
  for (std::size_t i = 0; i < bits.size(); ++i) {
    crc ^= static_cast<std::uint32_t>(bits[i]) << 23;
    crc <<= 1;
    if ((crc & 0x1000000) != 0) crc ^= kPolynomial;
  }
  return crc;
}

int accuracy_index(double accuracy_m) {
  // Upper ends of the indices; files hold these or the nominal values.
  constexpr std::array<double, 15> kUpTo{2.4, 3.4, 4.85, 6.85, 9.65, 13.65, 24,  48,
                                         96,  192, 384,  768,  1536, 3072,  6144};
  for (std::size_t i = 0; i < kUpTo.size(); ++i)
    if (accuracy_m <= kUpTo[i]) return static_cast<int>(i);
  return 15;
}

int sisa_index(double accuracy_m) {
  const auto steps = [&](double from, double step) {
    return static_cast<int>(std::ceil((accuracy_m - from) / step - 1e-6));
  };
  if (!(accuracy_m >= 0) || accuracy_m > 6) return 255;
  if (accuracy_m <= 0.5) return steps(0, 0.01);
  if (accuracy_m <= 1.0) return 50 + steps(0.5, 0.02);
  if (accuracy_m <= 2.0) return 75 + steps(1.0, 0.04);
  return 100 + steps(2.0, 0.16);
}

}  // namespace canyon::broadcast
