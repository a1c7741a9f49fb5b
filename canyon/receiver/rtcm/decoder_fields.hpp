#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "canyon/receiver/rtcm/rtcm_decoder.hpp"
#include "canyon/sky/broadcast/bits.hpp"

// Parts of CorrectionsDecoder that its sources share.

namespace canyon::rtcm {

/// A signed field; empty for its most negative value, which stands for "none".
inline std::optional<double> scaled(std::int64_t value, int width, double step) {
  if (value == -(std::int64_t{1} << (width - 1))) return std::nullopt;
  return static_cast<double>(value) * step;
}

/// Fields of a message one after the other; behind its end they are 0 and missing() says so.
class CorrectionsDecoder::Fields {
 public:
  explicit Fields(const broadcast::Bits& bits) : bits_(bits), number_(static_cast<int>(take(12))) {}
  std::uint64_t take(std::size_t width) {
    const std::size_t first = at_;
    at_ += width;
    return missing() ? 0 : bits_.number(first, width);
  }
  int count(std::size_t width) { return static_cast<int>(take(width)); }
  std::int64_t take_signed(std::size_t width) {
    const std::uint64_t value = take(width);
    const bool negative = (value >> (width - 1) & 1) != 0;
    return static_cast<std::int64_t>(value) - (negative ? std::int64_t{1} << width : 0);
  }
  std::vector<std::int64_t> column(std::size_t count, std::size_t width, bool is_signed) {
    std::vector<std::int64_t> values(count);
    for (std::int64_t& value : values)
      value = is_signed ? take_signed(width) : static_cast<std::int64_t>(take(width));
    return values;
  }
  std::string text() {
    std::string word;
    for (int n = count(8); n > 0 && !missing(); --n) {
      const auto c = static_cast<char>(take(8));
      word += c >= ' ' && c <= '~' ? c : '?';
    }
    return word;
  }
  [[nodiscard]] bool missing() const { return at_ > bits_.size(); }
  [[nodiscard]] bool lacks(std::size_t width) const { return at_ + width > bits_.size(); }
  [[nodiscard]] int number() const { return number_; }

 private:
  const broadcast::Bits& bits_;
  std::size_t at_ = 0;
  int number_ = 0;
};

}  // namespace canyon::rtcm
